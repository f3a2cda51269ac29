# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The animated GIF, and the path as text."""

import sys

import numpy as np
from phase_traj_ros.core import Corner, Direction
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.animation import Animation
from phase_traj_ros.io.results.path_text import path_lines
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from PIL import Image
import pytest
from rolled import rolled_frames, SHIFTS


def animated(path, frames, *, max_bytes=10**7, **options):
    animation = Animation(**options)
    result = replay(frames, Parameters(threshold=16.0), source='', watchers=[animation])
    animation.write(result, path, max_bytes=max_bytes)
    with Image.open(path) as picture:
        shown = []
        for index in range(picture.n_frames):
            picture.seek(index)
            shown.append((np.asarray(picture.convert('RGB')), picture.info['duration']))
    return shown


def test_a_picture_per_pair_with_the_frame_above(tmp_path):
    frames = rolled_frames()
    shown = animated(tmp_path / 'a.gif', frames)
    assert len(shown) == len(SHIFTS)
    assert {picture.shape for picture, _ in shown} == {(96 + 150, 160, 3)}
    for (picture, _), frame in zip(shown, frames[1:]):
        assert np.abs(picture[:96, :, 0].astype(int) - frame.image).mean() < 12
    # The path and the shift grow.
    assert (shown[0][0][96:] != shown[-1][0][96:]).any(axis=2).mean() > 0.02
    assert shown[-1][1] > shown[0][1]


def test_it_is_bounded(tmp_path):
    frames = rolled_frames([0] * 50)
    assert len(animated(tmp_path / 'a.gif', frames, limit=10)) <= 10
    shown = animated(tmp_path / 'b.gif', frames, max_bytes=20_000)
    assert 2 <= len(shown) < 50 and (tmp_path / 'b.gif').stat().st_size <= 20_000


def test_frames_of_another_size_do_not_stop_it(tmp_path):
    frames = rolled_frames([0, 30, 0])
    frames[3] = StampedFrame(frames[3].image[:80], frames[3].stamp_ns)
    assert len(animated(tmp_path / 'a.gif', frames)) == 2


def test_missing_pillow_is_reported(monkeypatch):
    monkeypatch.setitem(sys.modules, 'PIL.Image', None)
    with pytest.raises(MissingDependencyError, match='Pillow'):
        Animation()


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
