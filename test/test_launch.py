# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The launch file, where launch is installed."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def test_arguments_are_those_of_the_docs():
    pytest.importorskip('launch_ros')
    sources = pytest.importorskip('launch.launch_description_sources')
    description = sources.get_launch_description_from_python_launch_file(
        str(ROOT / 'launch' / 'phase_traj.launch.py'))
    page = (ROOT / 'docs' / 'reference' / 'launch.md').read_text()
    table = page.split('| launch argument |')[1].split('\n\n')[0]
    documented = [
        line.split('|')[1].strip(' `') for line in table.splitlines() if line.startswith('| `')]
    assert [argument.name for argument in description.get_launch_arguments()] == documented
