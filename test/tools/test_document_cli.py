# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The reference page of the command line agrees with the parser."""

from pathlib import Path
import runpy

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_is_that_of_the_parser():
    tool = runpy.run_path(str(ROOT / 'tools' / 'document_cli.py'))

    assert tool['PAGE'].read_text(encoding='utf-8') == tool['page'](), 'run make docs'
