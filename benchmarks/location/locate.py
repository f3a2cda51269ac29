# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How soon and how well drives are located on a road map, and how often wrongly.

Takes about an hour and writes docs/measurements/locate.md. The results of each part are kept in
out/locate, so a stopped run continues where it was. ``--part NAME`` measures one part, ``--page``
writes the page from the available results, ``--seeds N`` draws N times the noise. The part ``own``
needs the odometry that benchmarks/location/odometry.py records into out/locate/odometry.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
import json
from pathlib import Path

from benchmarks.location.drives import OUT
from benchmarks.location.outcome import Row
from benchmarks.location.page import page
from benchmarks.location.parts import PARTS
from benchmarks.shared.report import write_page
from benchmarks.shared.timing import prepare


def main() -> None:
    """Measure the parts that are missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--part', choices=PARTS)
    parser.add_argument('--page', action='store_true')
    parser.add_argument('--seeds', type=int, default=1)
    arguments = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    prepare()
    for part in [arguments.part] if arguments.part else [] if arguments.page else PARTS:
        if arguments.part or not _file(part).exists():
            rows = []
            for row in PARTS[part](arguments.seeds):
                rows.append(asdict(row))
                print(row, flush=True)
                _file(part).write_text(json.dumps({'rows': rows}))
    if not arguments.part:
        write_page('locate', page(_rows))


def _file(part: str) -> Path:
    return OUT / f'{part}.json'


def _rows(part: str) -> list[Row]:
    if not _file(part).exists():
        return []
    kept = json.loads(_file(part).read_text())['rows']
    return [Row(**{**row, 'likely': tuple(row['likely'])}) for row in kept]


if __name__ == '__main__':
    main()
