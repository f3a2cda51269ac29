# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The docstrings are clean under ament_pep257."""

import logging
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# Not the whole folder: it may contain environments and builds.
SOURCES = [
    name for name in ('setup.py', 'phase_traj_ros', 'test', 'launch', 'benchmarks', 'tools')
    if (ROOT / name).exists()]


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257(monkeypatch, caplog):
    ament_pep257 = pytest.importorskip('ament_pep257.main')
    caplog.set_level(logging.WARNING, 'pydocstyle.utils')  # not the name of every file
    monkeypatch.chdir(ROOT)  # so that what it prints are paths to follow

    assert ament_pep257.main(argv=SOURCES) == 0, 'its messages are in the captured output'
