# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The locator on small towns: it finds the place, follows it, and says when it does not know."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core import (
    LocatorSettings,
    MapLocator,
    PositionFix,
    Prior,
    RoadMap,
    ScaleRange,
)
from phase_traj_ros.core.localization.filter.resampling import merged
import pytest
from streets import drive, errors, follow, located, steps_of, Town


@pytest.fixture(scope='module')
def town():
    return Town()


@pytest.fixture(scope='module')
def poses(town):
    return drive(town.walk(14, seed=0))


@pytest.fixture(scope='module')
def found(town, poses):
    return follow(MapLocator(town.roads), steps_of(poses, seed=1))


def on_map(town):
    """Return a locator that knows that the vehicle is on the map: the first turns locate it."""
    return MapLocator(town.roads, prior=Prior(*town.nodes.mean(axis=0), 5000.0))


def claimed(estimates):
    return np.array([each.claimed for each in estimates])


def test_a_drive_is_located_and_followed(found, poses):
    start = located(found)
    assert start is not None and start < 1400
    assert claimed(found)[start:].all()
    assert np.median(errors(found, poses)[start:]) < 3.0
    assert errors(found, poses)[start:].max() < 25.0
    heading = [
        math.remainder(each.heading - pose[2], math.tau)
        for each, pose in zip(found[start:], poses[start + 1:])]
    assert np.degrees(np.median(np.abs(heading))) < 3.0


def test_nothing_is_claimed_before_the_first_turn(found, poses):
    turned = np.abs(np.unwrap(poses[:, 2]) - poses[0, 2]) > math.radians(60)
    assert not claimed(found)[:turned.argmax()].any()


def test_what_is_said_of_the_error_is_true(found, poses):
    start = located(found)
    off = errors(found, poses)[start:]
    said = np.array([each.standard_deviation for each in found[start:]])
    assert 0.3 < np.sqrt(np.mean((off / said) ** 2)) < 2.5


def test_a_scale_that_drifts_out_of_its_prior_is_followed_where_the_odometer_says_so(town, poses):
    half = len(poses) // 2
    steps = [
        replace(step, distance=step.distance * math.exp(max(number - half, 0) * 2.5e-4),
                scale_variance=1e-4)
        for number, step in enumerate(steps_of(poses, seed=1))]
    off = errors(follow(on_map(town), steps), poses)
    assert np.median(off[-100:]) < 10.0


def test_candidates_are_sorted_and_share_the_probability(found):
    for estimate in found[::100]:
        shares = [each.probability for each in estimate.candidates]
        assert shares == sorted(shares, reverse=True)
        assert sum(shares) <= 1.0 + 1e-6
        assert shares[0] == estimate.probability


def test_equal_input_gives_equal_output(town, poses, found):
    again = follow(MapLocator(town.roads), steps_of(poses, seed=1)[:400])
    assert again == found[:400]


def test_between_strides_the_place_follows_the_odometry(town, poses):
    fine = [
        replace(step, distance=step.distance / 4, yaw=step.yaw / 4)
        for step in steps_of(poses[:200]) for _ in range(4)]
    estimates = follow(MapLocator(town.roads), fine)
    # The first stride ends with step 20.
    places = np.array([(each.x, each.y) for each in estimates[:19]])
    np.testing.assert_allclose(np.hypot(*np.diff(places, axis=0).T), 0.25, rtol=0.2)


def test_on_the_map_of_another_town_nothing_is_claimed(town):
    other = drive(Town(seed=11).walk(14, seed=3))
    assert located(follow(MapLocator(town.roads), steps_of(other, seed=3))) is None


def test_in_a_town_of_equal_blocks_nothing_is_claimed():
    even = Town(even=True)
    steps = steps_of(drive(even.walk(14, seed=0)), seed=1)
    assert located(follow(MapLocator(even.roads), steps)) is None


def test_on_a_straight_road_nothing_is_claimed():
    roads = RoadMap.from_polylines([[(0, 0), (3000, 0)]])
    steps = steps_of(drive([(500, 0), (1500, 0)]), seed=1)
    assert located(follow(MapLocator(roads), steps)) is None


def test_a_long_straight_does_not_prove_that_the_vehicle_is_on_the_map():
    roads = RoadMap.from_polylines([[(0, 0), (9000, 0)]])
    locator = MapLocator(
        roads, prior=Prior(500.0, 0.0, 30.0, heading=0.0), scale=ScaleRange(1.0, 1.0))
    estimates = follow(locator, steps_of(drive([(500, 0), (2500, 0)]), seed=1))
    # The hypotheses stay close together, so what the candidates leave is that of no road.
    left = 1.0 - sum(each.probability for each in estimates[-1].candidates)
    assert left > LocatorSettings().null_share / 2


def test_the_side_of_a_loop_is_not_known():
    # Left turns only around a square: every side looks like the others.
    corners = np.array([(0, 0), (150, 0), (150, 150), (0, 150), (0, 0)])
    roads = RoadMap.from_polylines([corners])
    steps = steps_of(drive(np.concatenate([corners[:-1]] * 3)), seed=1)
    estimates = follow(MapLocator(roads), steps)
    assert located(estimates) is None
    assert len(estimates[-1].candidates) >= 3


def test_a_prior_helps(town, poses, found):
    prior = Prior(poses[0, 0], poses[0, 1], 60.0, heading=poses[0, 2])
    near = follow(MapLocator(town.roads, prior=prior), steps_of(poses, seed=1)[:900])
    assert located(near) < located(found)
    assert np.median(errors(near, poses)[located(near):]) < 3.0


def test_a_place_needs_no_proof_where_the_vehicle_is_known_to_be_on_the_map(town, poses, found):
    known = follow(on_map(town), steps_of(poses, seed=1)[:1000])
    assert located(known) < located(found)
    assert np.median(errors(known, poses)[located(known):]) < 3.0


def test_a_prior_far_from_all_roads_is_refused(town):
    with pytest.raises(ValueError, match='nearest one is'):
        MapLocator(town.roads, prior=Prior(1e5, 0.0, 100.0))


def test_an_unknown_scale_is_found(town, poses):
    steps = steps_of(poses, seed=1, scale=1.65)
    estimates = follow(MapLocator(town.roads, scale=ScaleRange(1.1, 2.2)), steps)
    start = located(estimates)
    assert start is not None
    assert np.median(errors(estimates, poses)[start:]) < 3.0
    assert estimates[-1].scale == pytest.approx(1.65, rel=0.03)


def test_the_prior_of_the_scale_counts_once(town, poses):
    scale = 1.1
    # Two deviations off: counted again at each turn, the prior would pull the scale back.
    estimates = follow(on_map(town), steps_of(poses, seed=1, scale=scale)[:1100])
    half = estimates[len(estimates) // 2:]
    assert np.median([each.scale for each in half]) == pytest.approx(scale, rel=0.02)


def test_one_way_streets_are_a_weak_prior(town, poses, found):
    # Wrong rules cost nothing but time.
    against = RoadMap.from_ways(town.nodes, town.streets, [1] * len(town.streets))
    estimates = follow(MapLocator(against), steps_of(poses, seed=1))
    start = located(estimates)
    assert start is None or np.median(errors(estimates, poses)[start:]) < 3.0


def u_turn(way):
    """Return poses along a way, a U-turn in the middle of its last street, and the way back."""
    middle = (way[-2] + way[-1]) / 2
    there = drive([*way[:-1], middle])
    x, y, yaw = there[-1]
    angle = yaw - math.pi / 2 + np.arange(1, 13) * math.pi / 12
    centre = np.array([x, y]) + 4.0 * np.array([-math.sin(yaw), math.cos(yaw)])
    arc = np.column_stack([
        centre[0] + 4.0 * np.cos(angle), centre[1] + 4.0 * np.sin(angle), angle + math.pi / 2])
    back = drive([middle, *way[-2::-1]])
    back[:, 2] += math.tau * round((yaw + math.pi - back[0, 2]) / math.tau)
    return np.concatenate([there, arc, back])


def test_a_u_turn_on_the_road_is_followed(town):
    poses = u_turn(town.walk(8, seed=2))
    estimates = follow(MapLocator(town.roads), steps_of(poses, seed=1))
    start = located(estimates)
    assert start is not None
    assert np.median(errors(estimates, poses)[start:]) < 4.0
    assert errors(estimates, poses)[-1] < 10.0
    assert estimates[-1].claimed


@pytest.mark.parametrize('number', [0, 1, 5, 6, 9])
def test_backing_out_of_a_side_street_keeps_the_place(town, number):
    # 20 m into a street that is not on the way, and back round the corner.
    way = town.way(14, seed=number)
    at, side = next(
        (at, side) for at in range(8, 14)
        for side in sorted(town.beside[way[at]] - set(way[at - 1:at + 2])))
    junction = town.nodes[way[at]]
    there, on = drive(town.nodes[[*way[:at + 1], side]]), drive(town.nodes[way])
    into = int(np.hypot(*(there[:, :2] - junction).T).argmin()) + 20
    back = into - 35
    on = on[int(np.hypot(*(on[:, :2] - there[back, :2]).T).argmin()) + 1:]
    poses = np.concatenate([there[:into], there[into - 2:back:-1], on])
    poses[:, 2] = np.unwrap(poses[:, 2])

    found = follow(on_map(town), steps_of(poses, seed=number))
    assert found[into].claimed
    held = claimed(found)[into:]
    assert held.mean() > 0.95
    assert errors(found, poses)[into:][held].max() < 20.0


def test_the_noise_of_a_standing_vehicle_is_not_driving_in_reverse(town, poses, found):
    rng = np.random.default_rng(3)
    locator, estimates = on_map(town), []
    for number, step in enumerate(steps_of(poses, seed=1)):
        estimates.append(locator.update(step))
        if number % 100 == 99:
            for moved in np.diff([0.0, *rng.normal(0.0, 0.02, 999), 0.0]):
                locator.update(replace(step, distance=moved, yaw=0.0))
    start = located(found)
    assert claimed(estimates)[start:].all()
    assert errors(estimates, poses)[start:].max() < 25.0


def test_gps_is_the_prior_until_it_is_lost(town, poses, found):
    locator, rng, estimates = MapLocator(town.roads), np.random.default_rng(5), []
    for number, step in enumerate(steps_of(poses, seed=1)):
        estimates.append(locator.update(step))
        if number < 200 and number % 10 == 0:
            x, y = poses[number + 1, :2] + rng.normal(0.0, 3.0, 2)
            locator.fix(PositionFix(x, y, 9.0, 9.0))
    assert located(estimates) < located(found)
    assert errors(estimates, poses)[located(estimates):].max() < 25.0


def test_an_outlier_of_gps_is_gated_but_many_that_agree_are_not(town, poses):
    locator = on_map(town)
    for step in steps_of(poses, seed=1)[:1000]:
        estimate = locator.update(step)
    assert estimate.claimed
    wrong = PositionFix(estimate.x + 200.0, estimate.y, 9.0, 9.0)
    assert not locator.fix(wrong)
    assert locator.fix(PositionFix(estimate.x + 2.0, estimate.y, 9.0, 9.0))
    # A receiver that is off for a second at 10 Hz is wrong once, not ten times.
    assert not any(locator.fix(PositionFix(wrong.x + 0.1 * number, wrong.y, 9.0, 9.0))
                   for number in range(10))
    answers = []
    for number, step in enumerate(steps_of(poses, seed=1)[1000:1060]):
        here = locator.update(step)
        if number % 6 == 5:
            answers.append(locator.fix(PositionFix(here.x + 200.0, here.y, 9.0, 9.0)))
    assert not any(answers[:3])
    assert any(answers)


def test_a_cut_spreads_the_candidates_and_is_recovered_from(town, poses):
    locator, steps = on_map(town), steps_of(poses, seed=1)
    for step in steps[:1000]:
        before = locator.update(step)
    assert before.claimed
    locator.interrupt(120.0, turn=math.pi)
    after = [locator.update(step) for step in steps[1080:]]
    assert after[0].probability < 0.5 and not after[0].claimed
    there = np.concatenate([poses[1080:1081], poses[1081:]])
    off = errors(after, there)
    assert min(
        math.hypot(each.x - there[1, 0], each.y - there[1, 1])
        for each in after[40].candidates) < 120.0
    assert np.median(off[-50:]) < 10.0


def test_a_new_drive_that_begins_elsewhere_is_found(town, poses):
    # Farther away than the hypotheses spread.
    locator = MapLocator(
        town.roads, prior=Prior(*poses[0, :2], 60.0), settings=LocatorSettings(moved_m=50.0))
    other = drive(town.walk(14, seed=8))
    assert math.hypot(*(other[0, :2] - poses[800, :2])) > 200.0
    before = follow(locator, steps_of(poses[:801], seed=1))
    assert before[-1].claimed
    locator.interrupt(math.inf, turn=math.pi)
    after = follow(locator, steps_of(other, seed=2))
    # By the same turns as from the start, not only when all other places have failed.
    assert 0 < located(after) < 700
    wrong = errors(after, other)[[each.claimed for each in after]]
    assert np.median(wrong) < 5.0


def test_a_short_gap_keeps_the_place(town, poses):
    locator, steps = on_map(town), steps_of(poses, seed=1)
    for step in steps[:1000]:
        before = locator.update(step)
    locator.interrupt(6.0, turn=math.radians(5.0))
    after = [locator.update(step) for step in steps[1003:]]
    assert before.claimed and after[-1].claimed
    assert errors(after, poses[1003:])[-1] < 10.0


@pytest.mark.parametrize('every', [100, 150])
def test_lost_frames_do_not_keep_a_drive_from_being_located(town, poses, every):
    locator, found = on_map(town), []
    for number, step in enumerate(steps_of(poses, seed=1)):
        if number % every == every // 2:
            locator.interrupt(5.0, turn=0.1)
        found.append(locator.update(step))
    start = located(found)
    assert start is not None and start < 900
    assert claimed(found)[start:].mean() > 0.95
    assert errors(found, poses)[start:].max() < 25.0


@pytest.mark.parametrize('seed', range(3))
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
    town = Town(seed=3 + seed)
    poses = drive(town.walk(14, seed=seed))[::apart]
    found = follow(MapLocator(town.roads, prior=Prior(*poses[0, :2], 60.0)), steps_of(poses))
    off = errors(found, poses)
    assert claimed(found).mean() > 0.5
    assert off[claimed(found)].max() < 25.0


def test_a_street_that_the_map_lacks_is_passed_in_a_gap():
    town = Town()
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


def test_leaving_the_roads_is_noticed_and_the_way_back_found(town):
    way = town.walk(20, seed=0)
    street = way[8] - way[7]
    beside = np.array([-street[1], street[0]]) / np.hypot(*street)
    park = [
        way[7] + 0.3 * street, way[7] + 0.35 * street + 45 * beside,
        way[7] + 0.6 * street + 50 * beside, way[7] + 0.65 * street + 12 * beside,
        way[7] + 0.45 * street + 30 * beside, way[7] + 0.8 * street]
    poses = drive([*way[:8], *park, *way[8:]])
    estimates = follow(on_map(town), steps_of(poses, seed=1))
    assert located(estimates) is not None
    off, said = errors(estimates, poses), claimed(estimates)
    assert not said[located(estimates):].all()
    assert (off[said] < 50.0).all()
    assert said[-1] and off[-1] < 10.0
