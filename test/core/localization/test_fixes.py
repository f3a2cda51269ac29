# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Position fixes: the place is known from them, and each counts where the vehicle was then."""

import math

import numpy as np
from phase_traj_ros.core import MapLocator, PositionFix, Prior
from phase_traj_ros.core.localization.fixes import Track
import pytest
from streets import drive, errors, located, steps_of, Town

# The vehicle drives 10 m/s, with a pose per 0.1 s; a fix per second.
EVERY, SECOND = 10, 10**9


@pytest.fixture(scope='module')
def poses(town):
    return drive(town.walk(8, seed=0))


def follow(town, poses, *, noise=2.0, shift=(0.0, 0.0), late=0):
    """Return the estimates of a drive with fixes that come so many poses after their stamp."""
    locator, rng, estimates = MapLocator(town.roads), np.random.default_rng(5), []
    steps = steps_of(poses, seed=1)
    for number, step in enumerate(steps):
        estimates.append(locator.update(step))
        if number % EVERY == 0 and 0 <= number - late < len(steps):
            x, y = poses[number - late + 1, :2] + rng.normal(0.0, noise, 2) + shift
            locator.fix(PositionFix(
                x, y, noise ** 2, noise ** 2, stamp_ns=step.stamp_ns - late * SECOND // EVERY))
    return estimates


def known(estimates):
    """Return how much of the way is claimed."""
    return np.mean([each.claimed for each in estimates])


@pytest.mark.parametrize('noise', [2.0, 10.0])
def test_as_long_as_there_is_gps_the_place_is_known(town, poses, noise):
    estimates = follow(town, poses, noise=noise)
    assert known(estimates) > 0.85
    assert errors(estimates, poses)[located(estimates):].max() < 15.0


def test_a_shift_between_gps_and_map_does_not_say_that_the_road_is_missing(town, poses):
    # Where the roads are drawn and what GPS says differ by some metres, all along.
    estimates = follow(town, poses, shift=(3.0, 4.0))
    assert known(estimates) > 0.85
    assert errors(estimates, poses)[located(estimates):].max() < 15.0


def test_a_receiver_that_repeats_its_last_fix_does_not_lose_the_place(town, poses):
    # As many do in a tunnel.
    locator, estimates, frozen = MapLocator(town.roads), [], 400
    for number, step in enumerate(steps_of(poses, seed=1)):
        estimates.append(locator.update(step))
        if number % EVERY == 0:
            x, y = poses[min(number, frozen) + 1, :2]
            used = locator.fix(PositionFix(x, y, 4.0, 4.0, stamp_ns=step.stamp_ns))
            assert not used or number <= frozen
    assert estimates[frozen].claimed
    # For 300 m.
    assert known(estimates[frozen:frozen + 300]) == 1.0
    assert errors(estimates, poses)[frozen:frozen + 300].max() < 15.0


def test_gps_far_from_all_roads_claims_nothing(town, poses):
    assert known(follow(town, poses[:400], shift=(15.0, 20.0))) == 0.0


def test_gps_says_at_once_that_the_vehicle_has_left_the_roads(town):
    way = town.walk(6, seed=0)
    along, middle = way[-1] - way[-2], (way[-2] + way[-1]) / 2
    beside = np.array([-along[1], along[0]]) / np.hypot(*along)
    poses = drive([*way[:-1], middle, middle + 45.0 * beside])
    estimates = follow(town, poses)
    away = np.array([town.roads.distance_to(*pose[:2]) for pose in poses[1:]]) > 25.0
    assert known(estimates) > 0.7 and away.any()
    assert not any(each.claimed for each, off in zip(estimates, away) if off)


@pytest.mark.parametrize('late', [-3, 6, 10])
def test_a_fix_counts_where_the_vehicle_was_at_its_stamp(town, poses, late):
    estimates = follow(town, poses, late=late)
    ahead = [
        (each.x - x) * math.cos(yaw) + (each.y - y) * math.sin(yaw)
        for each, (x, y, yaw) in zip(estimates, poses[1:]) if each.claimed]
    assert len(ahead) > 0.85 * len(estimates)
    assert abs(np.mean(ahead)) < 1.5


@pytest.mark.parametrize('age', [5 * SECOND + 1, -SECOND - 1])
def test_a_fix_whose_stamp_the_odometry_does_not_know_is_refused(town, poses, age):
    locator = MapLocator(town.roads)
    for step in steps_of(poses[:100]):
        locator.update(step)
    x, y = poses[99, :2]
    stamp_ns = step.stamp_ns - age
    assert not locator.fix(PositionFix(x, y, 4.0, 4.0, stamp_ns=stamp_ns))
    stamp_ns += SECOND // 10 if age > 0 else -SECOND // 10
    assert locator.fix(PositionFix(x, y, 4.0, 4.0, stamp_ns=stamp_ns))


def test_fixes_are_used_while_backing_and_after_it(town, poses):
    locator = MapLocator(town.roads, prior=Prior(*poses[0, :2], 50.0))
    there = poses[:400]
    way = np.concatenate([there, there[-2:-102:-1], there[-102:], poses[400:430]])
    used = []
    for number, (step, pose) in enumerate(zip(steps_of(way, seed=3), way[1:])):
        estimate = locator.update(step)
        if number >= 380 and number % 10 == 0:
            assert estimate.claimed
            used.append(locator.fix(PositionFix(*pose[:2], 4.0, 4.0)))
    # Not the one at the place where the vehicle turns round: it is less than 5 m after the last.
    assert len(used) == 26 and used.count(False) <= 2


@pytest.mark.parametrize(('number', 'least'), [(0, 0.02), (8, 0.4)])
def test_one_wrong_fix_after_a_gap_does_not_lose_the_place(number, least):
    town = Town(seed=3 + number)
    poses = drive(town.walk(14, seed=number))
    locator, steps = MapLocator(town.roads, prior=Prior(*poses[0, :2], 60.0)), steps_of(poses)
    gap = len(steps) // 2
    for step in steps[:gap]:
        locator.update(step)
    locator.interrupt(25.0, turn=0.5)
    for step in steps[gap + 10:gap + 18]:
        locator.update(step)
    x, y = poses[gap + 18, :2]
    locator.fix(PositionFix(x + 28.0, y - 28.0, 25.0, 25.0))
    after = [locator.update(step) for step in steps[gap + 18:]]
    off = errors(after, poses[gap + 18:])
    # Were the place given up for the fix, none.
    assert known(after) > least and off[-1] < 15.0
    assert max(each for each, place in zip(off, after) if place.claimed) < 25.0


@pytest.mark.parametrize('gaps', [(5.0,), (2000.0, 5.0)])
def test_the_first_fix_after_a_short_gap_corrects_a_wrong_prior(town, poses, gaps):
    x, y = poses[0, :2]
    far = town.nodes[np.argmax(np.hypot(*(town.nodes - (x, y)).T))]
    locator, steps = MapLocator(town.roads, prior=Prior(*far, 50.0)), steps_of(poses, seed=0)
    for step in steps[:60]:
        locator.update(step)
    for gap in gaps:
        locator.interrupt(gap, turn=0.1)
    assert locator.fix(PositionFix(*poses[60, :2], 25.0, 25.0))
    after = [locator.update(step) for step in steps[60:70]]
    assert errors(after, poses[60:]).max() < 30.0


def test_a_fix_from_before_a_gap_is_refused(town, poses):
    locator = MapLocator(town.roads, prior=Prior(*poses[0, :2], 50.0))
    steps = steps_of(poses[:101])
    for step in steps[:90]:
        locator.update(step)
    locator.interrupt(10.0)
    for step in steps[90:]:
        locator.update(step)
    x, y = poses[60, :2]
    assert not locator.fix(PositionFix(x, y, 4.0, 4.0, stamp_ns=steps[59].stamp_ns))


@pytest.fixture
def track():
    """Return ten seconds to the east at 10 m/s, each 0.5 s."""
    track = Track()
    for number in range(21):
        track.add(number * SECOND // 2, complex(5.0 * number), 5.0 * number)
    return track


@pytest.mark.parametrize('seconds', [5.0, 7.0, 7.1, 9.95, 10.0, 10.9])
def test_the_track_is_known_between_its_poses_and_a_little_ahead(track, seconds):
    place, way = track.at(round(seconds * SECOND))
    assert place == pytest.approx(10.0 * seconds) and way == pytest.approx(10.0 * seconds)


@pytest.mark.parametrize('seconds', [0.0, 4.9, 11.1])
def test_the_track_ends_a_few_seconds_ago(track, seconds):
    with pytest.raises(ValueError, match='stamp is'):
        track.at(round(seconds * SECOND))


def test_a_track_whose_clock_is_set_back_begins_again(track):
    track.add(2 * SECOND, 100j, 300.0)
    track.add(3 * SECOND, 110j, 310.0)
    with pytest.raises(ValueError, match=r'6\.0 s after'):
        track.at(9 * SECOND)
    assert track.at(5 * SECOND // 2) == (105j, 305.0)
