# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Position fixes: the place is known from them."""

import numpy as np
from phase_traj_ros.core import MapLocator, PositionFix
import pytest
from streets import drive, errors, located, steps_of, Town

# The vehicle drives 10 m/s, with a pose per 0.1 s; a fix per second.
EVERY = 10


@pytest.fixture(scope='module')
def town():
    return Town()


@pytest.fixture(scope='module')
def poses(town):
    return drive(town.walk(8, seed=0))


def follow(town, poses, *, noise=2.0, shift=(0.0, 0.0)):
    """Return the estimates of a drive with fixes."""
    locator, rng, estimates = MapLocator(town.roads), np.random.default_rng(5), []
    for number, step in enumerate(steps_of(poses, seed=1)):
        estimates.append(locator.update(step))
        if number % EVERY == 0:
            x, y = poses[number + 1, :2] + rng.normal(0.0, noise, 2) + shift
            locator.fix(PositionFix(x, y, noise ** 2, noise ** 2))
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
