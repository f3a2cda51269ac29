# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The locator after gaps, cuts and resets of the odometry."""

import math

import numpy as np
from phase_traj_ros.core import LocatorSettings, MapLocator, OdometryStep, Prior, RoadMap
from phase_traj_ros.core.localization.filter.resampling import merged
import pytest
from streets import claimed, drive, errors, follow, located, on_map, steps_of, Town


def test_a_cut_spreads_the_candidates_and_is_recovered_from(town, poses):
    locator, steps = on_map(town), steps_of(poses, seed=1)
    for step in steps[:400]:
        before = locator.update(step)
    assert before.claimed
    locator.interrupt(120.0, turn=math.pi)
    after = [locator.update(step) for step in steps[480:]]
    assert after[0].probability < 0.5 and not after[0].claimed
    there = np.concatenate([poses[480:481], poses[481:]])
    off = errors(after, there)
    assert min(
        math.hypot(each.x - there[1, 0], each.y - there[1, 1])
        for each in after[40].candidates) < 120.0
    assert np.median(off[-50:]) < 10.0


def test_a_new_drive_that_begins_elsewhere_is_found(town, poses):
    # Farther away than the hypotheses spread.
    locator = MapLocator(
        town.roads, prior=Prior(*poses[0, :2], 60.0), settings=LocatorSettings(moved_m=50.0))
    other = drive(town.walk(14, seed=3))
    assert math.hypot(*(other[0, :2] - poses[400, :2])) > 200.0
    before = follow(locator, steps_of(poses[:401], seed=1))
    assert before[-1].claimed
    locator.interrupt(math.inf, turn=math.pi)
    after = follow(locator, steps_of(other, seed=2))
    # By the same turns as from the start, not only when all other places have failed.
    assert 0 < located(after) < 700
    wrong = errors(after, other)[[each.claimed for each in after]]
    assert np.median(wrong) < 5.0


def test_a_step_of_kilometres_is_an_interruption(town, poses):
    after = []
    for skip in (
            lambda locator: locator.update(OdometryStep(stamp_ns=0, distance=5e3, yaw=0.1)),
            lambda locator: locator.interrupt(math.inf, turn=math.pi)):
        locator, steps = on_map(town), steps_of(poses, seed=1)
        before = follow(locator, steps[:400])[-1]
        skip(locator)
        after.append(locator.update(steps[400]))
        assert before.claimed and not after[-1].claimed
    assert after[0] == after[1]


def test_a_short_gap_keeps_the_place(town, poses):
    locator, steps = on_map(town), steps_of(poses, seed=1)
    for step in steps[:400]:
        before = locator.update(step)
    locator.interrupt(6.0, turn=math.radians(5.0))
    after = [locator.update(step) for step in steps[403:]]
    assert before.claimed and after[-1].claimed
    assert errors(after, poses[403:])[-1] < 10.0


@pytest.mark.parametrize('every', [100, 150])
def test_lost_frames_do_not_keep_a_drive_from_being_located(town, poses, every):
    locator, found = on_map(town), []
    for number, step in enumerate(steps_of(poses, seed=1)):
        if number % every == every // 2:
            locator.interrupt(5.0, turn=0.1)
        found.append(locator.update(step))
    start = located(found)
    assert start is not None and start < 450
    assert claimed(found)[start:].mean() > 0.95
    assert errors(found, poses)[start:].max() < 25.0


@pytest.mark.parametrize('seed', [2, 5])
def test_a_corner_in_a_gap_claims_no_wrong_place(town, seed):
    poses = drive(town.walk(12, seed=seed))
    turned = np.abs(poses[20:, 2] - poses[:-20, 2]) > 1.2
    gap = int(np.flatnonzero(turned & (np.arange(len(turned)) > len(poses) // 2))[0])
    locator, steps = MapLocator(town.roads, prior=Prior(*poses[0, :2], 50.0)), steps_of(poses)
    assert follow(locator, steps[:gap])[-1].claimed
    locator.interrupt(47.0, turn=0.95)
    after = follow(locator, steps[gap + 20:])
    off = errors(after, poses[gap + 20:])
    assert not claimed(after)[off > 30.0].any()
    assert off[-1] < 10.0


@pytest.mark.parametrize('apart', [14, 20])
@pytest.mark.parametrize('seed', range(2))
def test_distant_poses_claim_no_wrong_place_at_corners(apart, seed):
    town = Town(5, seed=3 + seed)
    poses = drive(town.walk(14, seed=seed))[::apart]
    found = follow(MapLocator(town.roads, prior=Prior(*poses[0, :2], 60.0)), steps_of(poses))
    off = errors(found, poses)
    assert claimed(found).mean() > 0.5
    assert off[claimed(found)].max() < 25.0


def test_a_street_that_the_map_lacks_is_passed_in_a_gap():
    town = Town(5)
    way = town.way(14, seed=0)
    hidden = {way[7], way[8]}
    roads = RoadMap.from_ways(
        town.nodes, [street for street in town.streets if set(street) != hidden])
    poses = drive(town.nodes[way])
    begin, end = (
        int(np.argmin(np.hypot(*(poses[:, :2] - town.nodes[node]).T))) for node in way[7:9])
    locator, steps = MapLocator(roads, prior=Prior(*poses[0, :2], 50.0)), steps_of(poses, seed=0)
    follow(locator, steps[:begin - 10])
    locator.interrupt(200.0, turn=math.pi)
    after = follow(locator, steps[end + 10:])
    off = errors(after, poses[end + 10:])
    assert not claimed(after)[off > 30.0].any()
    assert (off < 20.0).mean() > 0.5


def test_a_long_gap_of_a_lost_vehicle_keeps_the_true_place(town, poses):
    locator, steps = MapLocator(town.roads), steps_of(poses, seed=1)
    for step in steps[:200]:
        locator.update(step)
    # Of 12 s at 10 m/s.
    locator.interrupt(300.0, turn=math.pi)
    after = [locator.update(step) for step in steps[320:]]
    assert errors(after, poses[320:])[-1] < 10.0


def test_a_long_gap_spreads_no_more_hypotheses_than_there_may_be(town, poses, monkeypatch):
    made, most = [], 3000

    def merge(found, *rest):
        made.append(len(found))
        return merged(found, *rest)

    locator = MapLocator(town.roads, settings=LocatorSettings(most_hypotheses=most))
    for step in steps_of(poses, seed=1)[:300]:
        locator.update(step)
    monkeypatch.setattr('phase_traj_ros.core.localization.locator.merged', merge)
    locator.interrupt(1e200, turn=math.pi)
    assert 0.5 * most < made[0] <= most


@pytest.mark.parametrize('wrong', [(-1.0, 0.0), (math.nan, 0.0), (1.0, -1.0)])
def test_an_interruption_that_is_none_is_refused(town, wrong):
    with pytest.raises(ValueError, match='0 or more'):
        MapLocator(town.roads).interrupt(wrong[0], turn=wrong[1])
