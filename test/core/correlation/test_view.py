# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Bands, decimation and an upside-down camera."""

import numpy as np
from phase_traj_ros.core import EstimatorSettings, TrajectoryEstimator, View
from phase_traj_ros.errors import FrameError
import pytest
from textures import pair


def shift_of(view, first, second):
    estimator = TrajectoryEstimator(EstimatorSettings(view=view))
    estimator.update(first, 0)
    return estimator.update(second, 10**8).shift


def test_the_whole_frame_is_not_copied():
    frame = np.zeros((20, 30), np.uint8)
    assert np.shares_memory(View().of(frame), frame)
    assert View().of(frame).shape == frame.shape


def test_decimation_averages():
    frame = np.arange(35, dtype=np.float32).reshape(5, 7)
    small = View(decimation=2).of(frame)
    assert small.tolist() == [
        [frame[row:row + 2, column:column + 2].mean() for column in (0, 2, 4)] for row in (0, 2)]


@pytest.mark.parametrize('decimation', [1, 2, 3, 4])
def test_shifts_are_in_pixels_of_the_full_frame(decimation):
    frames = pair((240, 400), 24.0, -12.0)
    shift = shift_of(View(decimation=decimation), *frames)
    assert (shift.dx, shift.dy) == (pytest.approx(24, abs=0.3), pytest.approx(-12, abs=0.3))


def test_shifts_are_those_of_the_upright_picture():
    first, second = pair((120, 200), 9.0, -4.0)
    shift = shift_of(View(rotate_180=True), first[::-1, ::-1], second[::-1, ::-1])
    assert (shift.dx, shift.dy) == (pytest.approx(9, abs=0.1), pytest.approx(-4, abs=0.1))


def test_an_invalid_view_is_refused():
    with pytest.raises(ValueError, match='decimation is 0'):
        View(decimation=0)


def test_a_view_of_too_few_pixels_is_refused():
    estimator = TrajectoryEstimator(EstimatorSettings(view=View(decimation=50)))
    with pytest.raises(FrameError, match='at least 8x8'):
        estimator.update(np.zeros((100, 100), np.uint8), 0)


@pytest.mark.parametrize('shape', [(100,), (10, 10, 3)])
def test_frames_that_are_not_greyscale_are_refused(shape):
    with pytest.raises(FrameError, match='shape'):
        TrajectoryEstimator().update(np.zeros(shape, np.uint8), 0)
