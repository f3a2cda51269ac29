# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A pattern that all patches of the road share is taken out of them."""

import numpy as np
from phase_traj_ros.core.road.fixed_pattern import FixedPattern
import pytest


def test_what_stays_is_removed_and_what_passes_remains():
    rng = np.random.default_rng(0)
    shine = rng.normal(size=(40, 30)).astype(np.float32)
    roads = rng.normal(size=(60, 40, 30)).astype(np.float32)
    fixed = FixedPattern()
    for road in roads[:-1]:
        fixed.learn(road + shine)
    left = fixed.removed(roads[-1] + shine)
    assert np.corrcoef(left.ravel(), shine.ravel())[0, 1] == pytest.approx(0.0, abs=0.1)
    assert np.corrcoef(left.ravel(), roads[-1].ravel())[0, 1] > 0.95


def test_a_single_patch_is_no_pattern_and_is_not_kept():
    fixed, patch = FixedPattern(), np.ones((4, 4), np.float32)
    assert fixed.removed(patch) is patch
    fixed.learn(patch)
    assert fixed.removed(patch) is patch
    patch[:] = 5.0
    for _ in range(3):
        fixed.learn(np.full((4, 4), 2.0, np.float32))
    assert fixed.removed(patch).max() == pytest.approx(5.0 - 7.0 / 4.0)
