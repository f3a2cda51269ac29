# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The code is clean under ament_flake8."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# Not the whole folder: it may contain environments and builds.
SOURCES = [
    name for name in ('setup.py', 'phase_traj_ros', 'test', 'launch', 'benchmarks', 'tools')
    if (ROOT / name).exists()]


@pytest.mark.flake8
@pytest.mark.linter
def test_flake8(monkeypatch):
    ament_flake8 = pytest.importorskip('ament_flake8.main')
    monkeypatch.chdir(ROOT)  # so that what it prints are paths to follow

    status, errors = ament_flake8.main_with_errors(argv=SOURCES)

    assert status == 0, '\n'.join(errors)
