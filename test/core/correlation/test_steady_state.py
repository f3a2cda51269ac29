# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""In steady state, the correlator allocates nothing of a frame's size."""

from functools import partial
import tracemalloc

import cv2
import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.correlation import phase_correlation
from phase_traj_ros.core.correlation.transforms import OpenCvTransform, ScipyTransform
from phase_traj_ros.errors import MissingDependencyError
import pytest

# Large enough that numpy's own conversion buffers, 64 KiB each, are far below a quarter of it.
SHAPE = (1080, 1920)
FRAME_BYTES = SHAPE[0] * SHAPE[1]


def noise(dtype):
    rng = np.random.default_rng(0)
    return [rng.integers(0, 256, SHAPE).astype(dtype) for _ in range(2)]


def stripes():
    """Most bins of their spectra are empty, and are lifted to the floor."""
    row = (np.arange(SHAPE[1]) // 10 % 2 * 200).astype(np.uint8)
    return [np.tile(np.roll(row, shift), (SHAPE[0], 1)) for shift in (0, 3)]


def constant():
    return [np.full(SHAPE, value, np.uint8) for value in (7, 9)]


def allocated_by_each_update(correlator, frames):
    """Return the peak memory of each update beyond what was allocated before it."""
    peaks = []
    tracemalloc.start()
    try:
        for frame in frames:
            before, _ = tracemalloc.get_traced_memory()
            tracemalloc.reset_peak()
            correlator.update(frame)
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    return peaks


@pytest.mark.parametrize('make_frames', [
    partial(noise, np.uint8), partial(noise, np.uint16), partial(noise, np.float32), stripes,
    constant], ids=['uint8', 'uint16', 'float32', 'stripes', 'constant'])
@pytest.mark.parametrize('library', [OpenCvTransform, ScipyTransform])
def test_an_update_allocates_nothing_of_a_frames_size(make_frames, library, monkeypatch):
    try:
        transforms = library()
    except MissingDependencyError:
        pytest.skip('scipy is not installed')
    monkeypatch.setattr(phase_correlation, 'find_transform', lambda: transforms)
    correlator = PhaseCorrelator()
    frames = make_frames()
    # The first frame and the first pair make the permanent allocations.
    for frame in frames:
        correlator.update(frame)
    assert max(allocated_by_each_update(correlator, frames * 2)) < FRAME_BYTES / 4


def test_a_reset_keeps_the_buffers():
    frames = noise(np.uint8)
    correlator = PhaseCorrelator()
    correlator.update(frames[0])
    correlator.reset()
    assert max(allocated_by_each_update(correlator, frames)) < FRAME_BYTES / 4


class Copy:
    """Allocates a frame in OpenCV with every update."""

    def update(self, frame):
        return cv2.add(frame, 1)


def test_what_is_allocated_is_seen_here():
    # Both numpy and OpenCV report allocations to tracemalloc: without that, the tests above
    # would pass whatever happens.
    frames = noise(np.uint8)
    assert allocated_by_each_update(Copy(), frames)[0] >= FRAME_BYTES
    correlator = PhaseCorrelator()
    correlator.update(frames[0])
    smaller = [np.ascontiguousarray(frame[:-2]) for frame in frames]
    assert allocated_by_each_update(correlator, smaller)[0] > FRAME_BYTES
