# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
from phase_traj_ros.core.camera.camera_height import CameraHeight
import pytest


def test_without_anything_there_are_no_metres():
    assert CameraHeight(0.0, 0.04).metres is None


def test_a_height_that_was_given_is_believed_as_far_as_it_says():
    height = CameraHeight(1.65, 0.04)
    assert (height.metres, height.deviation) == (1.65, pytest.approx(0.04))


@pytest.mark.parametrize('given', [0.0, 1.5])
def test_speeds_calibrate_it(given):
    height = CameraHeight(given, 0.04)
    for _ in range(2000):
        height.add(1.8, 1.0, 0.1)
    assert height.metres == pytest.approx(1.8, rel=0.01)
    # No speedometer is better than this.
    assert height.deviation == pytest.approx(0.02)


def test_speeds_do_not_make_a_sure_height_less_sure():
    height = CameraHeight(1.65, 0.01)
    for _ in range(100):
        height.add(1.8, 1.0, 0.1)
    assert height.deviation <= 0.01


def learned(given=0.0):
    height = CameraHeight(given, 0.04)
    for _ in range(200):
        height.add(1.0, 1.0, 0.1)
    return height


def test_a_height_from_speeds_follows_the_lens():
    height = CameraHeight(0.0, 0.04)
    height.change_lens(0.5, 0.0, assumed=True)
    assert height.metres is None
    height = learned()
    sure = height.deviation
    height.change_lens(0.5, 0.0, assumed=True)
    assert height.metres == pytest.approx(2.0, rel=0.01)
    assert height.deviation == pytest.approx(math.hypot(sure, 0.15 * math.log(2.0)), rel=0.01)
    # The road that a fisheye sees has other proportions.
    height.change_lens(1.0, -1.0, assumed=False)
    assert height.deviation > 0.15


def test_the_column_of_a_lens_does_not_change_the_height():
    height = learned(1.65)
    before = height.metres, height.deviation
    height.change_lens(1.0, 0.0, assumed=False)
    assert (height.metres, height.deviation) == before


def test_a_given_height_counts_again_after_an_assumed_lens():
    height = learned(1.65)
    height.change_lens(0.5, 0.0, assumed=True)
    assert (height.metres, height.deviation) == (1.65, pytest.approx(0.04))
    # Without speeds, nothing depends on the lens.
    height = CameraHeight(1.65, 0.04)
    height.change_lens(0.8, -1.0, assumed=False)
    assert (height.metres, height.deviation) == (1.65, pytest.approx(0.04))


@pytest.mark.parametrize('pairs', [1, 20, 400])
def test_the_lens_changes_only_what_speeds_have_taught(pairs):
    """The given height does not depend on the lens."""
    given, factor = 1.65, 0.9
    height, told = CameraHeight(given, 0.04), CameraHeight(given, 0.04)
    for _ in range(pairs):
        height.add(1.5, 1.0, 0.1)
        # What the same speeds tell with the other lens.
        told.add(1.5, factor, 0.1)
    height.change_lens(factor, 0.0, assumed=False)
    assert height.metres == pytest.approx(told.metres, rel=0.01)


@pytest.mark.parametrize('seconds', [3, 20])
@pytest.mark.parametrize('rate_hz', [5, 30, 120])
def test_it_is_learned_by_time_at_any_frame_rate(rate_hz, seconds):
    slow, fast = CameraHeight(0.0, 0.04), CameraHeight(0.0, 0.04)
    for _ in range(seconds * 10):
        slow.add(0.18, 0.1, 0.1)
    for _ in range(seconds * rate_hz):
        fast.add(1.8 / rate_hz, 1.0 / rate_hz, 1.0 / rate_hz)
    assert fast.deviation == pytest.approx(slow.deviation, rel=0.05)
    assert fast.metres == pytest.approx(slow.metres, rel=0.02)


def test_a_long_pair_is_not_better_than_its_error():
    """Pairs of several seconds, as of a few pictures: each is off by a tenth of its own."""
    rng, errors = np.random.default_rng(4), []
    for _ in range(2000):
        height = CameraHeight(1.5, 0.2)
        true = 1.5 * (1.0 + 0.2 * rng.normal())
        for _ in range(3):
            height.add(5.0 * true * (1.0 + 0.1 * rng.normal()), 5.0, 5.0)
        errors.append((height.metres / true - 1.0) ** 2 / height.deviation ** 2)
    assert np.mean(errors) == pytest.approx(1.0, abs=0.25)
