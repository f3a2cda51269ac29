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
import pytest
from streets import claimed, drive, errors, follow, located, on_map, steps_of, Town


@pytest.fixture(scope='module')
def found(town, poses):
    return follow(MapLocator(town.roads), steps_of(poses, seed=1))


def test_a_drive_is_located_and_followed(found, poses):
    start = located(found)
    assert start is not None and start < 700
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
    other = drive(Town(5, seed=11).walk(14, seed=3))
    assert located(follow(MapLocator(town.roads), steps_of(other, seed=3))) is None


def test_in_a_town_of_equal_blocks_nothing_is_claimed():
    even = Town(5, even=True)
    steps = steps_of(drive(even.walk(14, seed=0)), seed=1)
    assert located(follow(MapLocator(even.roads), steps)) is None


def test_on_a_straight_road_nothing_is_claimed():
    roads = RoadMap.from_polylines([[(0, 0), (2000, 0)]])
    steps = steps_of(drive([(500, 0), (1500, 0)]), seed=1)
    assert located(follow(MapLocator(roads), steps)) is None


def test_a_long_straight_does_not_prove_that_the_vehicle_is_on_the_map():
    roads = RoadMap.from_polylines([[(0, 0), (3000, 0)]])
    locator = MapLocator(roads, prior=Prior(500.0, 0.0, 30.0), scale=ScaleRange(1.0, 1.0))
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
    prior = Prior(poses[0, 0], poses[0, 1], 60.0)
    near = follow(MapLocator(town.roads, prior=prior), steps_of(poses, seed=1)[:500])
    assert located(near) < located(found)
    assert np.median(errors(near, poses)[located(near):]) < 3.0


def test_a_place_needs_no_proof_where_the_vehicle_is_known_to_be_on_the_map(town, poses, found):
    known = follow(on_map(town), steps_of(poses, seed=1)[:500])
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
    estimates = follow(on_map(town), steps_of(poses, seed=1, scale=scale)[:900])
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

    locator = MapLocator(town.roads, prior=Prior(*poses[0, :2], 60.0))
    found = follow(locator, steps_of(poses, seed=number))
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
    for step in steps_of(poses, seed=1)[:400]:
        estimate = locator.update(step)
    assert estimate.claimed
    wrong = PositionFix(estimate.x + 200.0, estimate.y, 9.0, 9.0)
    assert not locator.fix(wrong)
    assert locator.fix(PositionFix(estimate.x + 2.0, estimate.y, 9.0, 9.0))
    # A receiver that is off for a second at 10 Hz is wrong once, not ten times.
    assert not any(locator.fix(PositionFix(wrong.x + 0.1 * number, wrong.y, 9.0, 9.0))
                   for number in range(10))
    answers = []
    for number, step in enumerate(steps_of(poses, seed=1)[400:460]):
        here = locator.update(step)
        if number % 6 == 5:
            answers.append(locator.fix(PositionFix(here.x + 200.0, here.y, 9.0, 9.0)))
    assert not any(answers[:3])
    assert any(answers)


def test_leaving_the_roads_is_noticed_and_the_way_back_found(town):
    way = town.walk(14, seed=4)
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
