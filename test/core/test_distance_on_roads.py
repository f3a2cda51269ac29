# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The distance on real, rendered and filmed roads, and which frames it needs."""

from dataclasses import replace
import math

from demo_street import street
import motorway
import numpy as np
from phase_traj_ros.core import (
    CodeSource,
    EstimatorSettings,
    Lens,
    PairStatus,
    StillnessSettings,
    TrajectoryEstimator,
    TravelState,
    View,
)
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.road.road_camera import RoadCamera
from phase_traj_ros.io.sources.folder import FolderSource
from phase_traj_ros.synthetic import (
    Camera,
    KITTI_CAMERA,
    plan_drive,
    pose_drive,
    poses_from_kitti,
    render_drive,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.degradations import encoded, sensor_noise
from phase_traj_ros.tasks.evaluation.scores import distance_error
import pytest

S = 10**9


def test_a_camera_that_is_turned_upside_down_has_another_pitch():
    """What was learned with the wrong ``rotate_180`` is wrong after the change."""
    poses = np.zeros((50, 5))
    poses[:, 0], poses[:, 3] = 0.6 * np.arange(50), math.radians(6.0)
    drive = pose_drive(
        'straight', poses, camera=Camera.with_field_of_view(496, 240, 82.0), seed=2)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(hfov_deg=82.0), code_source=CodeSource.AUTO, camera_height=1.65))
    for number, frame in enumerate(render_drive(drive)):
        if number == 25:
            estimator.reconfigure(replace(estimator.settings, view=View(rotate_180=True)))
        update = estimator.update(np.ascontiguousarray(frame[::-1, ::-1]), number * S // 10)
        if number > 26:
            assert update.travel.state is TravelState.MEASURED
            assert update.travel.distance == pytest.approx(0.6, rel=0.05)


@pytest.mark.parametrize('road', ['rendered', 'real'])
def test_a_film_is_measured_or_its_road_is_called_unclear(request, road):
    """The encoder copies the road with a wrong motion where that costs it less."""
    pytest.importorskip('av')
    if road == 'rendered':
        # In smaller pictures, even moderate compression shortens the distance.
        frames, stamps, model, steps = street(KITTI_CAMERA, 20)
        height = KITTI_CAMERA.above_ground
    else:
        folder, height = request.getfixturevalue('kitti_root') / '06', 1.65
        source = FolderSource(folder / 'image_0')
        model = source.camera(rectified=True)
        frames, stamps = zip(*((frame.image, frame.stamp_ns) for frame in list(source)[:20]))
        places = np.loadtxt(folder / 'poses.txt').reshape(-1, 3, 4)[:, :, 3]
        steps = np.linalg.norm(np.diff(places[:20], axis=0), axis=1)

    def driven(shown):
        estimator = TrajectoryEstimator(EstimatorSettings(
            lens=Lens(camera=replace(model, width=shown[0].shape[1])),
            code_source=CodeSource.AUTO, camera_height=height))
        for frame, stamp in zip(shown, stamps):
            estimator.update(frame, stamp)
        return estimator

    whole = driven(frames)
    assert whole.way.distance == pytest.approx(steps.sum(), rel=0.03)
    assert whole.reliability.of_drive.reliable
    for rate_factor in (23, 40):
        film = driven(encoded(frames, rate_factor=rate_factor))
        near = film.way.distance == pytest.approx(whole.way.distance, rel=0.03)
        # The first pairs have no distance where their speed cannot be told.
        assert near or {'road_unclear', 'distance_unknown'} & {*film.reliability.words}
        if rate_factor == 23:
            assert near and film.reliability.of_drive.reliable


@pytest.mark.parametrize(('rate_hz', 'speed'), [(4.5, 18.0), (2.5, 8.0)])
def test_a_few_large_slides_tell_the_speed(rate_hz, speed):
    """In a small picture, no pair alone shows a first speed of two heights per pair."""
    camera = Camera.with_field_of_view(320, 160, 98.0)
    drive = plan_drive('', [Straight(20 / rate_hz)], rate_hz=rate_hz, speed=speed, seed=5,
                       camera=camera)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(hfov_deg=98.0), code_source=CodeSource.AUTO, camera_height=camera.above_ground))
    travels = [
        update.travel for update in map(
            estimator.update, (sensor_noise(frame, sigma=1.0, seed=number)
                               for number, frame in enumerate(render_drive(drive))),
            drive.stamps_ns.tolist()) if update is not None]
    assert all(travel.state is TravelState.MEASURED for travel in travels[12:])
    assert [travel.distance for travel in travels[12:]] == pytest.approx(
        [speed / rate_hz] * len(travels[12:]), rel=0.03)


def _late_at_random(share):
    rng = np.random.default_rng(0)
    return rng.uniform(0.04, 0.07, 60) * (rng.random(60) < share)


_LATE = {
    'few': _late_at_random(0.15), 'half': _late_at_random(0.5),
    'even by 0.04 s': np.tile([0.04, 0.0], 30), 'even by 0.07 s': np.tile([0.07, 0.0], 30),
    'odd by a third of the interval': np.tile([0.0, 0.1 / 3], 30),
    'the first': np.array([0.08] + [0.0] * 59), 'the first two': np.array([0.08] * 2 + [0.0] * 58),
    'bursts': np.tile([0.0] * 12 + [0.2, 0.104, 0.008], 4),
    'all in pairs': np.tile([0.008, 0.104], 30)}


@pytest.mark.parametrize('delay', _LATE.values(), ids=_LATE)
def test_frames_that_arrive_late_change_no_distance(delay):
    frames, stamps, model, steps = street(KITTI_CAMERA, 45)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(camera=model), code_source=CodeSource.AUTO,
        camera_height=KITTI_CAMERA.above_ground))
    updates = [estimator.update(frame, stamp + round(S * late))
               for frame, stamp, late in zip(frames, stamps, delay)]
    assert estimator.way.distance == pytest.approx(steps.sum(), rel=0.02)
    assert estimator.reliability.of_drive.reliable
    assert all(update.travel.state is TravelState.MEASURED for update in updates[1:])


@pytest.mark.parametrize(('sequence', 'stretch'), [('00', slice(20, 90)), ('06', slice(0, 51))])
def test_real_roads(kitti_root, sequence, stretch):
    folder = kitti_root / sequence
    source = FolderSource(folder / 'image_0')
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(camera=source.camera(rectified=True)), code_source=CodeSource.AUTO,
        camera_height=1.65))
    places = [(0.0, 0.0)]
    for frame in list(source)[stretch]:
        update = estimator.update(frame.image, frame.stamp_ns)
        if update is not None:
            places.append((update.odometry.pose.x, update.odometry.pose.y))
    true = poses_from_kitti(np.loadtxt(folder / 'poses.txt'))[stretch, :2]
    assert abs(distance_error(np.array(places), true)) < 0.05


def test_a_motorway_in_small_pictures_at_ten_hertz_is_measured():
    """A frame later, the road is 3.5 m nearer, where ten rows were one."""
    camera = Camera.with_field_of_view(640, 240, 85)
    drive = plan_drive('', [Straight(3.0)], rate_hz=10.0, camera=camera, speed=35.0, seed=17)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(hfov_deg=85), camera_height=camera.above_ground))
    updates = [estimator.update(frame, stamp)
               for frame, stamp in zip(render_drive(drive), drive.stamps_ns.tolist())]
    assert {update.travel.state for update in updates[1:]} == {TravelState.MEASURED}
    assert estimator.way.distance == pytest.approx(3.5 * (len(updates) - 1), rel=0.015)


def test_the_edges_of_a_motorway_do_not_stop_a_fast_vehicle():
    """They look the same at any speed, as does the whole scene, and few blocks see more."""
    camera, stamps, frames = motorway.driven(grain=0.04, seconds=4.0, speed=20.0, rate_hz=6)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(hfov_deg=70), camera_height=camera.above_ground))
    for frame, stamp in zip(frames, stamps):
        estimator.update(frame, stamp)
    assert estimator.way.distance == pytest.approx(
        20.0 * (stamps[-1] - stamps[0]) / S, rel=0.02)


@pytest.mark.parametrize('rate_hz', [10, 30])
def test_a_film_that_begins_at_a_crawl_has_its_distance(rate_hz):
    """Its first slides are as small as those of a fixed pattern, and its pitch is not known."""
    drive = plan_drive('crawl', [Straight(4.0, 0.3)], rate_hz=rate_hz, seed=17,
                       camera=Camera.with_field_of_view(640, 240, 85.0))
    poses = drive.poses.copy()
    poses[:, 3] += math.radians(1.0)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(hfov_deg=85.0), code_source=CodeSource.AUTO, camera_height=1.65,
        stillness=StillnessSettings()))
    for number, frame in enumerate(render_drive(replace(drive, poses=poses))):
        update = estimator.update(sensor_noise(frame, sigma=1.0, seed=number),
                                  number * S // rate_hz)
        assert update is None or update.status is not PairStatus.STILL
    assert estimator.way.distance == pytest.approx(4.0 * 0.3, rel=0.1)


def test_reversing_goes_back():
    # In smaller pictures, so slow a vehicle hardly moves.
    frames, _, model, steps = street(KITTI_CAMERA, 16)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(camera=model), code_source=CodeSource.AUTO, camera_height=1.65))
    # Slowly, as vehicles reverse: every frame takes three times as long as it was driven in, and
    # the first one back six times.
    order = [*range(15), *[15] * 8, *range(14, 0, -1)]
    updates = [
        estimator.update(
            sensor_noise(frames[index], sigma=1.0, seed=place),
            (place + (place > 22)) * 3 * S // 10)
        for place, index in enumerate(order)]
    back = [update.travel for update in updates[-10:]]
    assert sum(travel.distance for travel in back) == pytest.approx(-steps[1:11].sum(), rel=0.04)
    assert updates[-1].tip.x < updates[20].tip.x - 5.0


def test_an_unknown_camera_leaves_a_parking_bay_backwards():
    camera = Camera.with_field_of_view(480, 270, 85.0)
    drive = plan_drive(
        '', [Straight(0.5, 0.0), Turn(-90.0, 8.0, -1.5), Straight(1.0, 0.0), Straight(3.0)],
        rate_hz=10.0, camera=camera, speed=4.0, seed=17)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, camera_height=camera.above_ground))
    updates = [estimator.update(frame, stamp)
               for frame, stamp in zip(render_drive(drive), drive.stamps_ns.tolist())][1:]
    learned = estimator.heading.camera.learned
    assert learned is not None and learned.focal_px == pytest.approx(camera.focal, rel=0.05)
    assert np.degrees(updates[-1].heading.heading) == pytest.approx(-90.0, abs=4.0)
    assert [turn.quarter_turns for turn in estimator.turns] == [-1]
    driven = [update.travel.distance for update in updates]
    steps = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T)
    # The first half of it is measured with a guess of the lens.
    assert sum(driven[:90]) == pytest.approx(-steps[:90].sum(), rel=0.15)
    assert sum(driven[95:]) == pytest.approx(steps[95:].sum(), rel=0.05)


def test_frames_are_left_out_while_the_road_is_measured_and_stays_in_view():
    frames, _, model, _ = street(count=10)
    road, camera = RoadCamera(), YawCamera(Lens(camera=model))
    assert road.reaches(camera, 1.0)
    camera.measure(frames[0], 0.1)
    road.start(frames[0], camera)

    def add(frame):
        return road.measure(frame, camera, camera.measure(frame, 0.1), 0.1).state

    assert not road.reaches(camera, 0.1)
    assert [add(frame) for frame in frames[1:5]][-1] is TravelState.MEASURED
    # A fifth of the length of the patches, in heights of the camera.
    assert road.reaches(camera, 0.9) and not road.reaches(camera, 1.1)
    assert road.reaches(camera, -0.9) and not road.reaches(camera, -1.1)
    # The speed is in doubt after half a second without a measurement.
    grey = np.full_like(frames[5], 128)
    assert add(grey) is TravelState.BRIDGED and road.reaches(camera, 0.1)
    assert {add(grey) for _ in range(5)} == {TravelState.BRIDGED}
    assert not road.reaches(camera, 0.1)


def test_frames_are_left_out_where_no_road_is_in_view():
    frames, _, model, _ = street(count=10)
    road = RoadCamera(pitch_deg=-50.0)
    camera = YawCamera(Lens(camera=model))
    camera.measure(frames[0], 0.1)
    road.start(frames[0], camera)
    assert not road.reaches(camera, 0.1)
    unknown = road.measure(frames[1], camera, camera.measure(frames[1], 0.1), 0.1)
    assert unknown.state is TravelState.UNKNOWN and road.reaches(camera, 0.1)
