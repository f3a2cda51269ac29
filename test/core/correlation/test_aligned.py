# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The same frames give the same shifts to the last bit, wherever arrays are in memory."""

import numpy as np
from phase_traj_ros.core import EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.core.correlation.spectrum import aligned_zeros
import pytest
from textures import pair

FRAMES = [np.roll(pair((96, 160), 0, 0)[0], place, axis=1) for place in (0, 5, 30, 60, 65, 20)]


def test_arrays_begin_at_a_cache_line():
    rng = np.random.default_rng(0)
    for _ in range(20):
        shape = tuple(rng.integers(1, 40, 2).tolist())
        array = aligned_zeros(shape)
        assert (array.shape, array.dtype) == (shape, np.float32)
        assert array.ctypes.data % 64 == 0
        assert not array.any() and array.flags.c_contiguous


@pytest.mark.parametrize('settings', [
    EstimatorSettings(), EstimatorSettings(lens=Lens(focal_px=150.0))])
def test_shifts_do_not_depend_on_where_arrays_lie(settings):
    rng = np.random.default_rng(0)
    seen = set()
    for _ in range(30):
        # Moves the next allocation.
        kept = [np.empty(int(size), np.uint8) for size in rng.integers(1, 5000, 20)]
        estimator = TrajectoryEstimator(settings)
        updates = [estimator.update(frame, index * 10**8) for index, frame in enumerate(FRAMES)]
        seen.add(tuple(
            (update.shift.dx, update.shift.dy, update.shift.response) for update in updates[1:]))
        del kept
    assert len(seen) == 1
