# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from phase_traj_ros.core.road.speed_profile import SpeedProfile
import pytest

SPEEDS = SpeedProfile.speeds
SEEN = np.ones(len(SPEEDS), np.bool_)


def noise(rng):
    """Return the sum of two patches, in each of which the best of nine columns counts."""
    return rng.normal(size=(2, 9, len(SPEEDS))).max(axis=1).sum(axis=0)


def add(profile, scores, seen, interval):
    profile.predict(interval)
    profile.add(scores, seen)


def peak(speed, height, width=0.4):
    return height * np.exp(-0.5 * ((SPEEDS - speed) / width) ** 2)


@pytest.mark.parametrize('interval', [1 / 60, 0.04, 0.1, 0.4])
def test_noise_tells_no_speed(interval):
    rng, profile = np.random.default_rng(1), SpeedProfile()
    told = []
    for _ in range(1500):
        add(profile, noise(rng), SEEN, interval)
        told.append(profile.best is not None)
    assert sum(told) == 0


@pytest.mark.parametrize('interval', [0.02, 0.04, 0.1, 0.2, 0.4])
@pytest.mark.parametrize('speed', [4.0, 25.0])
def test_what_hardly_shows_in_a_pair_shows_in_many(speed, interval):
    rng, profile, alone = np.random.default_rng(2), SpeedProfile(), []
    told = []
    for _ in range(100):
        scores = noise(rng) + peak(speed, 4.0)
        alone.append(SPEEDS[scores.argmax()])
        add(profile, scores, SEEN, interval)
        if profile.best is not None:
            told.append(profile.best[0])
    assert len(told) > 30
    assert max(abs(each - speed) for each in told) <= 0.75
    # A pair alone is wrong now and then.
    assert max(abs(each - speed) for each in alone) > 3.0


def test_a_slide_that_all_pairs_share_is_not_a_speed():
    """An encoder's copies have side lobes at the same slides, however old the keyframe is."""
    rng, profile, told = np.random.default_rng(3), SpeedProfile(), 0
    for index in range(400):
        age = 0.04 * (1 + index % 4)
        add(profile, noise(rng) + peak(0.6 / age, 4.0, 0.016 / age), SEEN, 0.04)
        told += profile.best is not None
    assert told < 0.02 * 400


def test_two_speeds_tell_none():
    rng, profile = np.random.default_rng(4), SpeedProfile()
    for _ in range(100):
        add(profile, noise(rng) + peak(8.0, 5.0) + peak(20.0, 5.0), SEEN, 0.04)
        assert profile.best is None


def test_a_road_that_is_out_of_sight_tells_nothing_new():
    rng, profile = np.random.default_rng(5), SpeedProfile()
    for _ in range(40):
        add(profile, noise(rng) + peak(12.0, 6.0), SEEN, 0.04)
    assert profile.confirms(12.5) and not profile.confirms(16.0)
    add(profile, np.zeros(len(SPEEDS)), SEEN, 0.04)
    assert profile.best is None and profile.confirms(12.5)
    for _ in range(40):
        add(profile, noise(rng), SEEN, 0.04)
    assert not profile.confirms(12.5)


def test_the_flank_of_a_peak_outside_is_not_a_speed():
    rng, profile, seen = np.random.default_rng(8), SpeedProfile(), SPEEDS > 8.0
    for _ in range(60):
        add(profile, noise(rng) + peak(7.5, 8.0, 1.0), seen, 0.04)
        assert profile.best is None


def test_speeds_that_are_seldom_seen_do_not_count():
    rng, profile = np.random.default_rng(6), SpeedProfile()
    for index in range(60):
        scores, seen = noise(rng), SEEN.copy()
        seen[SPEEDS > 20.0] = index % 2 == 0
        add(profile, scores + peak(30.0, 6.0), seen, 0.04)
        assert profile.best is None


def test_a_few_pairs_tell_nothing():
    rng, profile = np.random.default_rng(7), SpeedProfile()
    assert profile.best is None
    for _ in range(3):
        add(profile, noise(rng) + peak(12.0, 6.0), SEEN, 0.04)
        assert profile.best is None


def test_what_was_before_lost_frames_does_not_count():
    rng, profile = np.random.default_rng(9), SpeedProfile()
    for _ in range(40):
        add(profile, noise(rng) + peak(12.0, 6.0), SEEN, 0.1)
    assert profile.best is not None
    for interval in (3.0, 0.1, 0.1):
        add(profile, noise(rng) + peak(12.0, 6.0), SEEN, interval)
        assert profile.best is None


def test_what_was_before_a_stop_does_not_count():
    rng, profile = np.random.default_rng(7), SpeedProfile()
    for _ in range(40):
        add(profile, noise(rng) + peak(12.0, 6.0), SEEN, 0.04)
    assert profile.best is not None
    # While the vehicle stands, no pair is added.
    profile.predict(3.0)
    assert profile.best is None
    for _ in range(3):
        add(profile, noise(rng) + peak(12.0, 6.0), SEEN, 0.04)
        assert profile.best is None
