# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The path as text."""

from phase_traj_ros.core import Corner, Direction
from phase_traj_ros.io.results.path_text import path_lines
import pytest


def corner(x, y):
    return Corner(x, y, Direction.FORWARD, 0)


def test_a_path_as_text_starts_upwards():
    # Forward, left, forward: up, to the left, up.
    path = [corner(0, 0), corner(4, 0), corner(4, 3), corner(6, 3)]
    assert path_lines(path, columns=7, rows=7, braille=False) == [
        '*', '*', '*******', '      *', '      *', '      *', '      *']
    assert [line.strip() for line in path_lines(path, columns=4, rows=3) if line] == [
        '⡄', '⠉⢹', '⠈']


@pytest.mark.parametrize('braille', [True, False])
@pytest.mark.parametrize('path', [
    [], [corner(0, 0)], [corner(0, 0), corner(10**6, 0)],
    [corner(0, 0), corner(0, -10**6), corner(5, -10**6)]])
def test_it_fits_the_given_size_for_any_path(path, braille):
    lines = path_lines(path, columns=9, rows=5, braille=braille)
    assert len(lines) == 5 and max(map(len, lines)) <= 9
    assert any(lines) == bool(path)


def test_it_fits_into_a_single_character():
    assert path_lines([corner(0, 0), corner(3, 3)], columns=1, rows=1, braille=False) == ['*']
