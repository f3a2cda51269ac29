# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The distance in the estimator: units, speeds from elsewhere, and what becomes of the path."""

from dataclasses import replace
from functools import lru_cache
import math

from demo_street import street
import numpy as np
from phase_traj_ros.core import (
    CameraEstimate,
    CodeSource,
    EstimatorSettings,
    Lens,
    Movement,
    PairStatus,
    PathSource,
    TrajectoryEstimator,
    TravelState,
)
from phase_traj_ros.core.distance_meter import DistanceMeter
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.road_camera import RoadCamera
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest

S = 10**9


def settings(**values):
    _, _, model, _ = street()
    return EstimatorSettings(
        **{'lens': Lens(camera=model), 'code_source': CodeSource.AUTO, **values})


def run(chosen, speeds=()):
    """Drive along the street; return the estimator and its updates."""
    frames, stamps, _, _ = street()
    estimator, updates = TrajectoryEstimator(chosen), []
    for stamp, speed in speeds:
        estimator.add_speed(stamp, speed)
    for frame, stamp in zip(frames, stamps):
        update = estimator.update(frame, stamp)
        if update is not None:
            updates.append(update)
    return estimator, updates


# For tests that only look at what came of it.
driven = lru_cache(run)


def total(updates):
    return sum(update.travel.distance for update in updates)


def test_without_metres_the_path_is_in_heights_of_the_camera():
    _, updates = driven(settings())
    assert {update.travel.state for update in updates} == {TravelState.MEASURED}
    assert {update.odometry for update in updates} == {None}
    true = street()[3].sum() / 1.65
    assert total(updates) == pytest.approx(true, rel=0.03)
    assert updates[-1].tip.x == pytest.approx(true, rel=0.05)
    assert all(update.travel.variance > 0.0 for update in updates)


def test_the_distance_is_as_uncertain_as_the_focal_length():
    frames, _, model, _ = street()
    found = {}
    for deviation in (0.02, 0.3):
        camera = YawCamera(Lens(estimate=CameraEstimate(
            width=model.width, height=model.height, focal_px=model.fx,
            focal_deviation=deviation)))
        road = RoadCamera()
        camera.measure(frames[0], 0.1)
        road.start(frames[0], camera)
        found[deviation] = [
            road.measure(frame, camera, camera.measure(frame, 0.1), 0.1)
            for frame in frames[1:20]][-1]
    sure, doubtful = found.values()
    assert doubtful.distance == pytest.approx(sure.distance)
    assert doubtful.scale ** 2 - sure.scale ** 2 == pytest.approx(0.3 ** 2 - 0.02 ** 2)
    assert doubtful.variance > sure.variance + (0.25 * sure.distance) ** 2


def test_a_height_makes_metres_of_it():
    _, plain = driven(settings())
    _, metric = driven(settings(camera_height=1.5))
    assert [update.travel.distance for update in metric] == pytest.approx(
        [1.5 * update.travel.distance for update in plain])
    assert [update.odometry.speed for update in metric] == pytest.approx(
        [update.travel.distance / 0.1 for update in metric])
    last = metric[-1].odometry
    assert (last.pose.x, last.pose.y) == (metric[-1].tip.x, metric[-1].tip.y)
    # Four percent of the height are four percent of the way, and it is not surer than that.
    assert math.sqrt(last.covariance[0][0]) > 0.04 * last.pose.x


@pytest.mark.parametrize('pitch_deg', [1e-14, 4.0, -4.0])
def test_the_drive_mends_a_pitch_that_is_given_wrong(pitch_deg):
    _, found = driven(settings())
    _, given = driven(settings(camera_pitch_deg=pitch_deg))
    # A pitch that was believed cost up to a third of the distance.
    assert total(given) == pytest.approx(total(found), rel=0.03)


def test_the_codes_do_not_depend_on_it():
    _, with_it = driven(settings())
    _, without = driven(settings(path_from=PathSource.CODES))
    assert [update.step for update in with_it] == [update.step for update in without]
    assert {update.travel for update in without} == {None}


def test_a_speed_wins_calibrates_the_height_and_leaves_the_road_to_go_on():
    _, stamps, _, steps = street()
    # The wheels say 10 % more than is true, and fail after 1.5 s; a speed holds for 2.5 s.
    speeds = tuple((stamp, 1.1 * step / 0.1) for stamp, step in zip(stamps, steps))[:16]
    _, updates = driven(settings(awaits_speeds=True, camera_height=1.65), speeds)
    states = [update.travel.state for update in updates]
    assert states == [TravelState.GIVEN] * 40 + [TravelState.MEASURED] * 4
    assert [update.travel.distance for update in updates[:15]] == pytest.approx(
        list(1.1 * steps[:15]), rel=0.01)
    _, by_height = driven(settings(camera_height=1.65))
    assert total(updates[40:]) > 1.01 * total(by_height[40:])


@pytest.mark.parametrize('rate_hz', [10, 30])
def test_a_height_is_learned_from_speeds_at_any_frame_rate(rate_hz):
    plan = [Straight(4.5)]
    camera = Camera.with_field_of_view(320, 180, 70)
    drive = plan_drive('', plan, rate_hz=rate_hz, speed=8.0, camera=camera, seed=3)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(hfov_deg=70.0), code_source=CodeSource.AUTO, awaits_speeds=True))
    stamps = drive.stamps_ns.tolist()
    for stamp in range(stamps[0], stamps[0] + 3 * S // 2, S // 10):
        estimator.add_speed(stamp, 8.0)
    for frame, stamp in zip(render_drive(drive), stamps):
        update = estimator.update(frame, stamp)
    # The speeds have ended: what is left is the height.
    assert update.travel.state is TravelState.MEASURED
    assert update.speed == pytest.approx(8.0, rel=0.1)


@pytest.mark.parametrize(('given', 'road', 'doubted'), [
    (5.0, -0.3, True), (5.0, 0.3, False), (-5.0, -0.3, False), (-5.0, 0.3, True),
    (5.0, -0.05, False), (0.0, -0.3, False), (-1e-17, 0.3, False)])
def test_a_road_that_long_slides_against_a_given_speed_is_a_doubt(given, road, doubted):
    """The speed counts: the road may be one that a leader hides as it drives off."""
    meter, against = sliding(given, road)
    assert against.state is TravelState.GIVEN
    assert against.distance == pytest.approx(0.1 * given)
    assert against.rivalled is doubted
    # A road that is not seen shows nothing.
    hidden = Travel(road, 1e-4, TravelState.BRIDGED)
    assert not meter.update(hidden, PairStatus.OK, 4 * S, S // 10).rivalled


def test_speeds_that_are_a_second_late_do_not_contradict_the_road():
    meter, late = sliding(5.0, -0.3, until_ns=S)
    assert not late.rivalled
    # Once the road has slid as the speeds say, the time begins again.
    for at, road in ((1.1, 0.3), (1.2, -0.3), (2.3, -0.3)):
        measured = Travel(road, 1e-4, TravelState.MEASURED)
        assert not meter.update(measured, PairStatus.OK, round(at * S), S // 10).rivalled


def sliding(given, road, *, until_ns=2 * S):
    """Return a meter after a road has slid for some time, and the newest distance."""
    meter = DistanceMeter(EstimatorSettings(awaits_speeds=True, camera_height=1.5))
    for stamp in range(S // 10, until_ns + 1, S // 10):
        meter.speeds.add(stamp, given)
        travel = meter.update(
            Travel(road, 1e-4, TravelState.MEASURED), PairStatus.OK, stamp, S // 10)
    return meter, travel


def test_without_a_speed_or_a_height_nothing_is_made_up_in_metres():
    _, updates = driven(settings(awaits_speeds=True))
    assert {update.travel.state for update in updates} == {TravelState.UNKNOWN}
    assert total(updates) == 0.0
    assert updates[-1].tip.x == 0.0
    for update in updates:
        pose, odometry = update.odometry.pose, update.odometry
        assert (pose.x, pose.y, odometry.speed) == (0.0, 0.0, 0.0)
        # The heading goes on, and what is unknown says so.
        assert pose.yaw == update.heading.heading
        assert odometry.yaw_rate == pytest.approx(update.heading.rate)
        assert odometry.speed_variance == 1e6
    assert abs(updates[-1].odometry.pose.yaw) > 0.5
    deviations = [math.sqrt(update.odometry.covariance[0][0]) for update in updates]
    assert deviations == sorted(deviations) and deviations[-1] > 10.0 * len(updates) / 10


def test_a_constant_speed_leaves_nothing_to_ask():
    estimator, updates = driven(settings(speed=7.0))
    assert {update.travel.state for update in updates} == {TravelState.GIVEN}
    assert total(updates) == pytest.approx(0.7 * len(updates))
    # All of the error is that of the speedometer.
    for update in updates:
        assert math.sqrt(update.travel.variance) == pytest.approx(0.7 * update.travel.scale)
    assert estimator._meter._road._meter is None


def test_a_camera_that_changes_on_the_way_costs_a_pair_at_most():
    frames, stamps, model, _ = street()
    estimator, states = TrajectoryEstimator(settings()), []
    for index, (frame, stamp) in enumerate(zip(frames, stamps)):
        if index == 25:
            estimator.use_lens(Lens(camera=replace(model, fx=model.fx * 1.02)))
        update = estimator.update(frame, stamp)
        if update is not None:
            states.append(update.travel.state)
    assert set(states[:24] + states[25:]) == {TravelState.MEASURED}
    assert states[24] is TravelState.BRIDGED


def test_the_speed_in_doubt_after_another_lens():
    """The speed so far was measured with another focal length, which may have been a guess."""
    frames, stamps, model, _ = street()
    estimator = TrajectoryEstimator(settings())
    for index, (frame, stamp) in enumerate(zip(frames[:27], stamps)):
        if index == 25:
            estimator.use_lens(Lens(camera=replace(model, fx=model.fx * 1.2)))
        update = estimator.update(frame if index < 26 else np.zeros_like(frame), stamp)
    assert update.travel.state is TravelState.BRIDGED
    assert math.sqrt(update.travel.variance) > 0.25 * update.travel.distance


def test_a_lens_that_changes_while_the_vehicle_stands():
    """Its pitch is learned anew from the motion, although the speed was known to be 0."""
    frames, _, model, _ = street()
    estimator = TrajectoryEstimator(settings(camera_height=1.65))
    order, updates = [*range(12), *[12] * 15, *range(13, 40)], []
    for place, index in enumerate(order):
        if place == 20:
            estimate = CameraEstimate(
                width=model.width, height=model.height, focal_px=model.fx, focal_deviation=0.02)
            estimator.use_lens(Lens(estimate=estimate))
        frame = sensor_noise(frames[index], sigma=1.0, seed=place)
        updates.append(estimator.update(frame, place * S // 10))
    assert {update.travel.state for update in updates[-8:]} == {TravelState.MEASURED}


def test_after_a_cut_the_speed_before_it_says_nothing():
    frames, stamps, _, steps = street()
    # Every third frame of the first scene: three times as fast as the second one, mirrored.
    film = [*frames[0:42:3], *(np.ascontiguousarray(frame[:, ::-1]) for frame in frames[:12])]
    estimator = TrajectoryEstimator(settings())
    updates = [estimator.update(frame, stamp) for frame, stamp in zip(film, stamps)][1:]
    [cut] = [number for number, update in enumerate(updates) if update.cut]
    true = steps[:12].mean() / 1.65
    for update in updates[cut:]:
        if update.travel.state is TravelState.MEASURED:
            assert update.travel.distance == pytest.approx(true, rel=0.25)
    assert updates[-1].travel.state is TravelState.MEASURED


def test_a_gap_is_bridged():
    frames, stamps, _, steps = street()
    estimator = TrajectoryEstimator(settings(max_gap=0.5))
    for index in (*range(20), *range(30, 40)):
        update = estimator.update(frames[index], stamps[index])
        if index == 30:
            assert update.travel.state is TravelState.BRIDGED
            # At the last speed, while the vehicle has slowed down.
            assert update.travel.distance == pytest.approx(11 * steps[18] / 1.65, rel=0.05)
            assert abs(update.travel.distance - steps[19:30].sum() / 1.65) < 3.0 * math.sqrt(
                update.travel.variance)
    assert update.travel.state is TravelState.MEASURED


@pytest.mark.parametrize('change', [
    {'camera_height': 3.3}, {'camera_height_deviation': 0.1}, {'camera_pitch_deg': 5.0}])
def test_the_mounting_of_the_camera_cannot_change_on_the_way(change):
    estimator = TrajectoryEstimator(settings(camera_height=1.65))
    for frame, stamp in zip(street()[0][:3], street()[1]):
        estimator.update(frame, stamp)
    with pytest.raises(ValueError, match='fixed at the start'):
        estimator.reconfigure(replace(estimator.settings, **change))


@pytest.mark.parametrize('pitch', [60.1, -90.0, math.nan])
def test_a_pitch_that_no_camera_has_is_refused(pitch):
    with pytest.raises(ValueError, match='camera_pitch_deg'):
        settings(camera_pitch_deg=pitch)


def test_a_vehicle_that_stands_goes_exactly_nowhere():
    frames, _, _, _ = street(count=60)
    estimator = TrajectoryEstimator(settings(camera_height=1.65))
    order = [*range(12), *[12] * 15, *range(13, 60)]
    updates = [
        estimator.update(sensor_noise(frames[index], sigma=1.0, seed=place), place * S // 10)
        for place, index in enumerate(order)]
    # It stopped at once, which no vehicle does: that takes a moment to be believed.
    standing = updates[20:27]
    assert {update.travel.state for update in standing} == {TravelState.STANDING}
    assert {update.travel.distance for update in standing} == {0.0}
    assert {update.status for update in standing} == {PairStatus.STILL}
    assert {update.step.movement for update in standing} == {Movement.NO_CHANGE}
    # Later, it turns.
    assert {update.status for update in updates[30:39]} == {PairStatus.OK}
    assert estimator.reliability.reliable
    # The road may be in doubt as the speed jumps, but not while the vehicle stands.
    assert all(span.end_ns <= 16 * S // 10 or span.start_ns >= 26 * S // 10
               for span in estimator.reliability.spans)
    assert {update.travel.state for update in updates[34:]} == {TravelState.MEASURED}


def test_a_road_on_which_only_copies_show_is_unclear_though_its_distance_is_unknown(monkeypatch):
    unknown = Travel(1.0, 1.0, TravelState.UNKNOWN, rivalled=True)
    monkeypatch.setattr(RoadMeter, 'update', lambda *_, **__: unknown)
    estimator, updates = run(settings(camera_height=1.65))
    assert total(updates) == 0.0
    assert 'road_unclear' in estimator.reliability.words


@pytest.mark.parametrize('chosen', [{'camera_height': 1.65}, {'code_step': 5.0}])
def test_speeds_that_were_noise_are_unclear(monkeypatch, chosen):
    refuting = Travel(1.0, 1.0, TravelState.MEASURED, refuted=0.5)
    monkeypatch.setattr(RoadMeter, 'update', lambda *_, **__: refuting)
    assert run(settings(**chosen))[0].reliability.words == ('road_unclear',)
