# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The distances of pairs come from that since a keyframe, and add up to it."""

import math

import numpy as np
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.speed_filter import SpeedFilter
import pytest


def known(speed=5.0, deviation=0.8):
    speeds = SpeedFilter()
    speeds.add(speed, deviation ** 2)
    return speeds


def test_the_pairs_add_up_to_the_way_between_the_keyframes():
    key, sums = RoadKeyframe(), 0.0
    for way in (0.4, 1.1, 1.4):
        sums += key.add(way, 0.02 ** 2, known(), 0.1)[0]
        assert sums == pytest.approx(key.distance)
    key.bridge(0.5, 0.1 ** 2)
    assert key.distance == pytest.approx(sums + 0.5)
    key.expired = True
    distance, variance = key.add(2.6, 0.03 ** 2, known(), 0.1)
    assert sums + 0.5 + distance == pytest.approx(2.6)
    # What was measured is not made better by what was foreseen.
    assert variance == pytest.approx(0.03 ** 2)


@pytest.mark.parametrize('noise', [0.02, 0.2])
def test_the_way_scatters_as_it_says(noise):
    """Speeds and measured ways with drawn errors; the second pair is bridged."""
    rng, interval, errors, first, pairs = np.random.default_rng(3), 0.1, [], [], []
    for _ in range(2000):
        key, way, told = RoadKeyframe(), 0.0, 0.0
        for pair in range(3):
            speed = 5.0 + 0.8 * rng.normal()
            way += speed * interval
            if pair == 1:
                key.bridge(5.0 * interval, (0.8 * interval) ** 2)
                continue
            before = key.distance
            told, variance = key.add(way + noise * rng.normal(), noise ** 2, known(), interval)
            if pair == 0:
                first.append((key.distance - way) ** 2 / key.variance)
                pairs.append((told - way) ** 2 / variance)
        errors.append((key.distance - way) ** 2 / key.variance)
        assert told == pytest.approx(key.distance - before)
    assert np.mean(first) == pytest.approx(1.0, abs=0.15)
    assert np.mean(errors) == pytest.approx(1.0, abs=0.15)
    # A pair alone is as sure as the speed, and better where the road is.
    assert (0.7 if noise > 0.1 else 0.0) < np.mean(pairs) < 1.1


def test_without_a_speed_the_way_is_as_measured():
    key = RoadKeyframe()
    assert key.add(0.4, 0.02 ** 2, SpeedFilter(), 0.1) == (0.4, 0.02 ** 2)
    distance, variance = key.add(1.0, 0.02 ** 2, SpeedFilter(), 0.1)
    assert distance == pytest.approx(0.6) and variance > 0.0


def test_rotations_and_times_of_the_pairs_add_up():
    key = RoadKeyframe()
    for _ in range(4):
        key.add_rotation(0.01, -0.02, 0.03, nod=-0.01, interval=0.05, near=0.004)
    assert (key.yaw, key.pitch, key.roll, key.nod, key.age, key.passing) == pytest.approx(
        (0.04, -0.08, 0.12, -0.04, 0.2, 0.016))
    sure = key.pitch_deviation
    # Without the blocks, the pitch may be anything that the springs allow.
    key.add_rotation(0.01, 0.0, 0.0, nod=0.0, interval=0.05, near=None)
    assert key.pitch_deviation > 2.0 * sure
    assert (key.yaw, key.age, key.passing) == pytest.approx((0.05, 0.25, 0.016))


def aged(age=0.1, yaw=0.0):
    key = RoadKeyframe()
    key.add_rotation(yaw, 0.0, 0.0, nod=0.0, interval=age, near=None)
    return key


@pytest.mark.parametrize('sign', [-1.0, 1.0])
def test_a_frame_is_too_far_if_the_next_slide_or_turn_or_time_is(sign):
    # The next pair slides as this one does: 0.4 becomes 0.8, of 0.75 that are allowed.
    assert aged().is_far(sign * 0.4, 0.1) and not aged().is_far(sign * 0.35, 0.1)
    # One fifth as long, it adds a fifth.
    assert not aged().is_far(sign * 0.6, 0.02)
    assert aged(yaw=sign * 0.07).is_far(0.0, 0.1) and not aged(yaw=sign * 0.05).is_far(0.0, 0.1)
    assert aged(0.6).is_far(0.0, 0.1) and not aged(0.4).is_far(0.0, 0.1)


def turned(passing, yaw=0.0, age=0.1):
    key = RoadKeyframe()
    key.add_rotation(yaw, 0.0, 0.0, nod=0.0, interval=age, near=passing)
    return key


def test_what_the_blocks_show_tells_how_far_the_road_slides_at_least():
    stands, creeps, drives = turned(0.001), turned(0.01), turned(0.1)
    assert not stands.moves and not stands.drives and stands.min_slide == 0.0
    assert creeps.moves and not creeps.drives and creeps.min_slide == 0.0
    assert drives.moves and drives.drives
    # The nearest blocks are farther away than one height, and hardly ever nearer than two.
    assert 0.1 < drives.min_slide <= 0.2
    reverses = turned(-0.1)
    assert reverses.moves and reverses.recedes and reverses.min_slide == -drives.min_slide
    assert drives.passes and not drives.recedes
    # Blocks that do not agree: it moves, and nobody knows how far.
    unknown = turned(None)
    assert unknown.moves and unknown.drives and unknown.min_slide == 0.0


@pytest.mark.parametrize('sign', [-1.0, 1.0])
def test_only_one_that_drives_turns_by_degrees_in_a_second(sign):
    assert turned(0.0, sign * math.radians(2.0), 0.5).turns
    assert not turned(0.0, sign * math.radians(1.0), 0.5).turns
