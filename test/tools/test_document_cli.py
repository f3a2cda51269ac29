# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The generated pages of the reference agree with the code."""

from pathlib import Path
import runpy

ROOT = Path(__file__).resolve().parents[2]


def test_the_pages_are_up_to_date():
    tool = runpy.run_path(str(ROOT / 'tools' / 'document_cli.py'))

    for path, text in tool['pages']().items():
        assert path.read_text(encoding='utf-8') == text, 'run make docs'
