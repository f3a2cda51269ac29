# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A vehicle that drives round and round: another lap shows nothing new."""

import math

import numpy as np
from phase_traj_ros.core import LocatorSettings, MapLocator, OdometryStep, Prior
from phase_traj_ros.core.localization.filter.likelihood import NullHypothesis
from phase_traj_ros.core.localization.filter.strides import DeadReckoning
import pytest
from streets import claimed, drive, errors, follow, located, steps_of, Town


@pytest.fixture(scope='module')
def town():
    return Town()


def test_laps_do_not_prove_a_place_in_another_town(town):
    # A similar block of the other town fits each lap as well as the one before.
    block = [12, 19, 20, 13]
    poses = drive(town.nodes[[*block * 3, block[0]]])
    found = follow(MapLocator(Town(seed=5).roads), steps_of(poses, seed=1))
    assert not claimed(found).any()


def test_a_drive_is_located_on_its_way_from_laps(town):
    way = town.way(12, seed=2)
    begin = way.index(next(node for node in way if way.count(node) == 1))
    on = way[begin:]
    block = next(
        (on[0], a, b, c) for a in sorted(town.beside[on[0]] - {on[1]})
        for b in sorted(town.beside[a] - {on[0]}) for c in sorted(town.beside[b] - {a})
        if on[0] in town.beside[c] and c != on[0])
    poses = drive(town.nodes[[*block * 3, *on]])
    found = follow(MapLocator(town.roads), steps_of(poses, seed=1))
    assert located(found) is not None
    assert errors(found, poses)[claimed(found)].max() < 25.0


def there_and_back(corners, times):
    """Return the corners of a drive back and forth, which turns round beyond the last ones."""
    way = [*corners]
    for number in range(times):
        to = corners[::-1] if number % 2 == 0 else corners
        ahead = (to[0] - to[1]) / math.dist(to[0], to[1])
        aside = np.array([-ahead[1], ahead[0]])
        way += [to[0] + 5 * (ahead + aside), to[0] + 10 * ahead, to[0] + 5 * (ahead - aside),
                to[0] - 15 * ahead, *to[1:]]
    return np.array(way)


def test_driving_back_and_forth_does_not_prove_a_place_in_another_town(town):
    poses = drive(there_and_back(town.nodes[town.way(4, seed=0)], 4))
    found = follow(MapLocator(Town(seed=4).roads), steps_of(poses, seed=1))
    assert not claimed(found).any()


def test_driving_back_and_forth_keeps_a_known_place(town):
    poses = drive(there_and_back(town.nodes[town.way(4, seed=0)], 4))
    found = follow(
        MapLocator(town.roads, prior=Prior(*poses[0, :2], 60.0)), steps_of(poses, seed=1))
    known, off = claimed(found), errors(found, poses)
    assert known[located(found):].mean() > 0.6
    # While it turns, where the map has no loop.
    assert (off[known] > 35.0).mean() < 0.03


@pytest.mark.parametrize('block', [(17, 24, 25, 18), (40, 47, 48, 41)])
def test_a_vehicle_that_drives_round_in_a_yard_has_left_the_roads(town, block):
    """Inside a block that it has driven around: most poses are near earlier ones."""
    corners = town.nodes[list(block)]
    inner = corners.mean(axis=0) + 0.45 * (corners - corners.mean(axis=0))
    gate = (corners[0] + corners[1]) / 2
    laps = drive([*np.tile(corners, (3, 1)), corners[0], gate])
    poses = drive([*np.tile(corners, (3, 1)), corners[0], gate,
                   (inner[0] + inner[1]) / 2, *np.roll(np.tile(inner, (3, 1)), -1, axis=0)])
    found = follow(
        MapLocator(town.roads, prior=Prior(*poses[0, :2], 60.0)), steps_of(poses, seed=1))
    known = claimed(found)
    assert known[:len(laps)].any()
    assert not known[len(laps) + 60:][errors(found, poses)[len(laps) + 60:] > 35.0].any()


def repeated(steps):
    """Return whether each stride of some steps, pairs of distance and yaw, is repeated."""
    reckoning = DeadReckoning(LocatorSettings(), 1.0)
    strides = [
        reckoning.add(OdometryStep(stamp_ns=0, distance=distance, yaw=yaw))
        for distance, yaw in steps]
    return np.array([stride.repeated for stride in strides if stride is not None])


def circle(metres, circumference, sign=1.0):
    """Return steps of a metre along a circle."""
    return [(1.0, sign * math.tau / circumference)] * metres


@pytest.mark.parametrize('circumference', [70, 400, 2000])
def test_the_second_lap_is_repeated_and_the_first_is_not(circumference):
    rng = np.random.default_rng(0)
    # The odometry drifts by 1 %, and by 1 degree per root of 100 m.
    steps = [(1.01 * distance, yaw + rng.normal(0.0, math.radians(0.1)))
             for distance, yaw in circle(3 * circumference, circumference)]
    told = repeated(steps)
    lap = len(told) // 3
    assert not told[:lap - 12].any()
    assert told[lap + 2:].all()


def test_the_way_back_on_a_street_is_new():
    there = [(1.0, 0.0)] * 300
    turn = [(1.0, math.pi / 12)] * 12
    assert not repeated([*there, *turn, *there]).any()


def test_bends_and_streets_side_by_side_are_new():
    winding = 6 * [*circle(40, 160), *circle(40, 160, -1.0)]
    assert not repeated(winding).any()
    # To the next street, 60 m aside, and on in the same direction.
    corner = [(1.0, math.pi / 16)] * 8
    aside = [*corner, *[(1.0, 0.0)] * 50, *[(1.0, -math.pi / 16)] * 8]
    assert not repeated([*[(1.0, 0.0)] * 200, *aside, *[(1.0, 0.0)] * 200]).any()


def test_the_null_hypothesis_is_not_updated_by_another_lap():
    null, reckoning = NullHypothesis(LocatorSettings()), DeadReckoning(LocatorSettings(), 1.0)
    for distance, yaw in circle(300, 100):
        log_weight, turned, evidence = null.log_weight, null.turned, null.log_evidence
        stride = reckoning.add(OdometryStep(stamp_ns=0, distance=distance, yaw=yaw))
        if stride is not None:
            null.follow(stride, 5.0, 1.0)
            assert stride.repeated is ((null.log_weight, null.turned) == (log_weight, turned))
            # The evidence that the vehicle leaves the roads goes on.
            assert null.log_evidence != evidence
    assert 0.6 * math.tau < null.turned < math.tau
