# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A reduced frame holds the means of its blocks, in whatever steps they are taken."""

import numpy as np
from phase_traj_ros.core.correlation.view import reduced
import pytest


def means(frame, down, across):
    height, width = frame.shape[0] // down, frame.shape[1] // across
    blocks = frame[:height * down, :width * across].reshape(height, down, width, across)
    return blocks.mean(axis=(1, 3), dtype=np.float64)


@pytest.mark.parametrize(
    'factors', [(1, 1), (2, 2), (3, 3), (4, 4), (6, 6), (8, 8), (4, 2), (3, 1)])
@pytest.mark.parametrize(('dtype', 'error'), [(np.uint8, 1.6), (np.float32, 1e-3)])
def test_blocks_become_their_means(factors, dtype, error):
    frame = np.random.default_rng(1).integers(0, 256, (83, 101)).astype(dtype)
    small = reduced(frame, *factors)
    assert small.dtype == dtype
    assert np.abs(small - means(frame, *factors)).max() <= error


def test_a_constant_frame_keeps_its_grey_level():
    frame = np.full((64, 64), 201, np.uint8)
    assert (reduced(frame, 8, 8) == 201).all()
