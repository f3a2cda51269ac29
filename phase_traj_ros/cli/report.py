# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Prints codes."""

from typing import Any

from phase_traj_ros.core import ChainCode, CodeSeries


def print_codes(codes: ChainCode) -> None:
    """Print both codes in run-length form."""
    _print_series('movement ', codes.movement)
    _print_series('direction', codes.direction)


def _print_series(name: str, series: CodeSeries[Any]) -> None:
    runs = ' '.join(f'{int(run.code)}x{run.count}' for run in series.runs)
    print(f'{name} ({len(series)}): {runs}')
