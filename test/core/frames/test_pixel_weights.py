# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A mask and areas that are found go together."""

from types import SimpleNamespace

import numpy as np
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.frames.pixel_weights import PixelWeights
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.heading.yaw_camera import YawCamera

MASK = np.ones((8, 10), np.float32)
MASK[:, 5:] = 0.5
AREAS = np.full((8, 10), 255, np.uint8)
AREAS[:2] = 0


def test_what_either_leaves_out_does_not_count():
    weights = PixelWeights(MASK)
    assert np.array_equal(weights.current, MASK)
    weights.use(AREAS)
    assert np.array_equal(weights.current, MASK * (AREAS > 0))
    assert np.array_equal(weights.in_8_bits, (255 * MASK * (AREAS > 0)) // 1)
    weights.use(None)
    assert np.array_equal(weights.current, MASK)
    assert PixelWeights(None).current is None
    assert PixelWeights(None).in_8_bits is None


def test_areas_of_other_frames_are_forgotten():
    weights = PixelWeights(None)
    weights.use(AREAS)
    assert weights.keep_for((8, 10)) and not weights.keep_for((10, 8))
    assert weights.current is None


def test_the_camera_is_learned_from_what_counts():
    told = []
    learning = SimpleNamespace(
        use_mask=told.append, cut=lambda: told.append('cut'), forget=lambda: None)
    heading = VisualCompass(YawCamera(
        Lens(hfov_deg=80.0), mask=MASK, learning=learning))
    heading.camera.exclude(AREAS)
    heading.camera.turn_over(MASK[::-1, ::-1])
    heading.camera.cut()
    first, with_areas, turned, cut = told
    assert np.array_equal(first > 127, MASK > 0.5)
    assert np.array_equal(with_areas > 0, AREAS > 0)
    # The areas are found again.
    assert np.array_equal(turned, first[::-1, ::-1])
    assert cut == 'cut'
