# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Repeated pictures: they measure nothing, and cost nothing."""

from functools import cache

import cv2
import numpy as np
from phase_traj_ros.core import (
    CameraModel,
    CodeSource,
    EstimatorSettings,
    Lens,
    Movement,
    PairStatus,
    StillnessSettings,
    TrajectoryEstimator,
)
from phase_traj_ros.core.frames.repeats import RepeatDetector
from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.synthetic import Camera, plan_drive, render, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import encoded, sensor_noise
import pytest

S = 10**9
CAMERA = Camera.with_field_of_view(320, 240, 70.0)
MODEL = CameraModel(
    width=320, height=240, fx=CAMERA.focal, fy=CAMERA.focal, cx=CAMERA.cx, cy=CAMERA.cy)
AUTO = EstimatorSettings(
    code_source=CodeSource.AUTO, lens=Lens(camera=MODEL), camera_height=1.65,
    stillness=StillnessSettings())
PAPER = EstimatorSettings(threshold=16.0)


@cache
def frames():
    drive = plan_drive('corner', [Straight(1.0), Turn(90, 2.5, 4.0), Straight(1.0)],
                       rate_hz=10.0, camera=CAMERA, seed=3)
    return list(render_drive(drive))


def fed(settings, shown):
    """Return the estimator and its updates, for pictures by index and stamps in seconds."""
    estimator = TrajectoryEstimator(settings)
    updates = [estimator.update(frames()[index], round(stamp * S)) for index, stamp in shown]
    return estimator, updates[1:]


def as_jpeg(frame, quality):
    return cv2.imdecode(
        cv2.imencode('.jpg', frame, [cv2.IMWRITE_JPEG_QUALITY, quality])[1],
        cv2.IMREAD_GRAYSCALE)


def filmed(pictures, path, *, rate_hz):
    """Return pictures as a film in MPEG-4 shows them."""
    height, width = pictures[0].shape
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter_fourcc(*'mp4v'), rate_hz, (width, height))
    if not writer.isOpened():
        pytest.skip('OpenCV cannot write MPEG-4 here')
    for picture in pictures:
        writer.write(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))
    writer.release()
    film = cv2.VideoCapture(str(path))
    return [cv2.cvtColor(film.read()[1], cv2.COLOR_BGR2GRAY) for _ in pictures]


@cache
def stopped():
    """Return pictures without noise up to a stop, from the stop on, and the way in metres."""
    stop = 20
    drive = plan_drive('', [Straight(2.0), Straight(0.1, 0.0), Straight(3.0)], rate_hz=10.0,
                       camera=CAMERA, speed=7.0, seed=3)
    assert (drive.poses[stop] == drive.poses[stop + 1]).all()
    scene = drive.build_scene()
    pictures = [render(scene, CAMERA, drive.pose(number)) for number in range(len(drive))]
    way = float(np.hypot(*np.diff(drive.poses[:, :2], axis=0).T).sum())
    return pictures[:stop], pictures[stop:], way


@pytest.mark.parametrize(('stop', 'noise'), [(5, 0.0), (30, 0.0), (30, 1.0)])
def test_a_vehicle_that_stands_for_long_in_a_film_is_not_frozen(stop, noise, tmp_path):
    before, after, true = stopped()
    pictures = [*before, *(10 * stop - 1) * after[:1], *after]
    pictures = [sensor_noise(picture, sigma=noise, seed=number) if noise else picture
                for number, picture in enumerate(pictures)]
    estimator = TrajectoryEstimator(AUTO)
    for number, picture in enumerate(filmed(pictures, tmp_path / 'film.mp4', rate_hz=10)):
        estimator.update(picture, number * S // 10)
    assert estimator.way.distance == pytest.approx(true, rel=0.025)
    assert estimator.reliability.reliable and estimator.reliability.of_drive.spans == ()
    # The camera itself, without an encoder, gives one picture for ever when it is frozen.
    for number in range(40):
        estimator.update(pictures[-1], (len(pictures) + number) * S // 10)
    assert estimator.reliability.words == ('frozen',)


@cache
def taken(seconds, speed, rate_hz):
    """Return the pictures of a straight road."""
    drive = plan_drive(
        '', [Straight(seconds)], rate_hz=rate_hz, camera=CAMERA, speed=speed, seed=3)
    return list(render_drive(drive))


def converted(seconds, *, taken_hz, shown_hz, speed):
    """Return the frames and stamps of a film of a straight road, of one rate made of another."""
    pictures = taken(seconds, speed, taken_hz)
    for number in range(int(seconds * shown_hz)):
        yield pictures[number * taken_hz // shown_hz], round(number * S / shown_hz)


@pytest.mark.parametrize(('taken_hz', 'shown_hz'), [(24, 30), (24, 60)])
def test_a_film_at_another_rate_has_the_distance_though_its_stamps_jump(taken_hz, shown_hz):
    """The pictures are equally far apart, the stamps by one or two intervals of the film."""
    estimator = TrajectoryEstimator(AUTO)
    for frame, stamp in converted(2, taken_hz=taken_hz, shown_hz=shown_hz, speed=25.0):
        estimator.update(frame, stamp)
    newest = (2 * shown_hz - 1) * taken_hz // shown_hz
    assert estimator.way.distance == pytest.approx(25.0 * newest / taken_hz, rel=0.03)
    assert estimator.reliability.reliable


def test_the_stamps_of_a_film_that_repeats_pictures_are_unsure_and_others_are_not():
    shown = frames()[0]
    detector = RepeatDetector()

    def take(repeats):
        detector.keep(shown)
        for number in range(repeats):
            assert detector.is_repeated(shown, 40_000_000 * (number + 1))
        return detector.deviation_ns

    # Every picture as often as the others: the time between two is what the stamps say.
    assert [take(2) for _ in range(5)] == [0.0] * 5
    take(3)
    # Two exposures, each up to an interval of 40 ms before its stamp.
    errors = np.random.default_rng(0).uniform(0, 40e6, (2, 100_000))
    assert take(2) == pytest.approx((errors[0] - errors[1]).std(), rel=0.02)
    assert [take(2) for _ in range(100)][-1] == 0.0
    # Two messages of one exposure do not repeat it in a film.
    detector.keep(shown)
    assert detector.is_repeated(shown, 1_000_000)
    assert [take(0) for _ in range(100)][-1] == 0.0


@pytest.mark.parametrize(('settings', 'times'), [(AUTO, 3), (PAPER, 2)], ids=['auto', 'paper'])
def test_every_picture_several_times_is_every_picture_once(settings, times):
    once, single = fed(settings, [(index, 0.1 * index) for index in range(len(frames()))])
    many, updates = fed(settings, [
        (index // times, 0.1 * index / times) for index in range(times * len(frames()))])
    new = updates[times - 1::times]
    assert [update.status for update in new] == [update.status for update in single]
    assert [update.step.movement for update in new] == [
        update.step.movement for update in single]
    assert list(many.codes.direction) == list(once.codes.direction)
    repeated = [update for index, update in enumerate(updates) if (index + 1) % times]
    assert {update.status for update in repeated} == {PairStatus.REPEATED}
    assert {update.step for update in repeated if update.step.appended} == set()
    assert {update.step.movement for update in repeated} == {Movement.NO_CHANGE}
    assert many.counters.repeated == len(repeated)
    assert many.frames == times * len(frames())
    # The pair after them covers their time.
    assert {update.interval_ns for update in new} == {S // 10}
    if settings is AUTO:
        assert many.way.distance == pytest.approx(once.way.distance)
        assert [update.heading.heading for update in new] == pytest.approx(
            [update.heading.heading for update in single])
        assert [update.heading.rate for update in new] == pytest.approx(
            [update.heading.rate for update in single])
    assert many.reliability.reliable


def test_stamps_less_than_2_ms_apart_are_of_one_exposure():
    shown = [(index, 0.1 * index) for index in range(20)]
    expected, _ = fed(AUTO, shown)
    doubled = [each for index, stamp in shown for each in ((index, stamp), (index, stamp + 0.001))]
    found, updates = fed(AUTO, doubled)
    assert [update.status for update in updates[::2]] == [PairStatus.REPEATED] * 20
    assert found.way.distance == pytest.approx(expected.way.distance)


def test_a_frozen_camera_is_said_and_unreliable():
    shown = [(min(index, 12), 0.1 * index) for index in range(30)]
    estimator, updates = fed(AUTO, shown)
    assert {update.status for update in updates[12:]} == {PairStatus.REPEATED}
    assert {update.odometry for update in updates[12:]} == {None}
    assert Reason.FROZEN in estimator.reliability.reasons


def test_a_standing_camera_is_not_frozen():
    estimator = TrajectoryEstimator(AUTO)
    statuses = [
        estimator.update(sensor_noise(frames()[0], sigma=1.0, seed=index), index * S // 10)
        for index in range(30)]
    assert {update.status for update in statuses[10:]} == {PairStatus.STILL}
    assert estimator.reliability.reliable


def test_a_picture_that_an_encoder_repeats_is_repeated():
    detector = RepeatDetector()
    detector.keep(as_jpeg(frames()[3], 90))
    # The second time it is encoded from what it was decoded to.
    again = as_jpeg(as_jpeg(frames()[3], 90), 95)
    assert np.any(again != as_jpeg(frames()[3], 90))
    assert detector.is_repeated(again, S // 30)
    assert not detector.is_repeated(as_jpeg(frames()[4], 90), S // 30)


def test_every_picture_twice_in_a_video_is_found(tmp_path):
    file = str(tmp_path / 'twice.mp4')
    height, width = frames()[0].shape
    video = cv2.VideoWriter(file, cv2.VideoWriter_fourcc(*'mp4v'), 20.0, (width, height))
    for index in range(20):
        for _ in range(2):
            video.write(cv2.cvtColor(frames()[index], cv2.COLOR_GRAY2BGR))
    video.release()
    shown, detector, found = cv2.VideoCapture(file), RepeatDetector(), []
    for _ in range(40):
        frame = cv2.cvtColor(shown.read()[1], cv2.COLOR_BGR2GRAY)
        found.append(detector.is_repeated(frame, S // 20))
        if not found[-1]:
            detector.keep(frame)
    # The encoder improves its very first picture by much.
    assert found[2:] == 19 * [False, True]


@pytest.mark.parametrize('rate_factor', [20, 26])
def test_a_fast_encoder_of_a_noisy_picture_costs_no_distance(rate_factor):
    """Each repetition has several grey levels of noise: cameras encode so, not as studios do."""
    pytest.importorskip('av')
    taken = [sensor_noise(frame, sigma=1.5, seed=index) for index, frame in enumerate(frames())]
    shown = encoded(
        [frame for frame in taken for _ in range(3)], rate_factor=rate_factor, rate_hz=30,
        preset='ultrafast')
    once, thrice = (TrajectoryEstimator(AUTO) for _ in range(2))
    for index, frame in enumerate(shown):
        thrice.update(frame, index * S // 30)
        if index % 3 == 0:
            once.update(frame, index * S // 30)
    # Until the motion has halted and gone on, nothing tells such a video.
    assert 2 * len(taken) - 6 <= thrice.counters.repeated <= 2 * len(taken)
    assert thrice.way.distance == pytest.approx(once.way.distance, rel=0.03)
    assert list(thrice.codes.direction) == list(once.codes.direction)
    assert thrice.reliability.reliable


def test_a_slow_robot_repeats_nothing():
    """At the end of its turns, the picture moves by 0.2 px only."""
    drive = plan_drive('robot', [Straight(1.0), Turn(90, 3.0, 1.5), Straight(1.0)], rate_hz=60.0,
                       camera=Camera.with_field_of_view(640, 360, 80.0), speed=1.4, seed=3)
    drive = drive.take(range(200, 255))
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(hfov_deg=80.0), stillness=StillnessSettings()))
    for index, frame in enumerate(render_drive(drive)):
        estimator.update(sensor_noise(frame, sigma=1.5, seed=index), index * S // 60)
    assert estimator.counters.repeated == 0


def test_a_standing_vehicle_in_a_video_without_noise_is_not_frozen():
    again = frames()[3].copy()
    again[40:56, 40:56] += 3
    detector = RepeatDetector()
    detector.keep(frames()[3])
    assert detector.is_repeated(again, S // 30)
    assert not detector.is_repeated(again, S // 2)


@pytest.mark.parametrize('other', [
    lambda frame: sensor_noise(frame, sigma=1.0, seed=1), lambda frame: frame.astype(np.uint16),
    lambda frame: frame[:-1], lambda frame: np.roll(frame, 1, axis=1),
    lambda frame: cv2.circle(frame.copy(), (200, 50), 9, 0, -1)],
    ids=['noise', 'depth', 'size', 'shift', 'bird'])
def test_another_picture_is_not_repeated(other):
    detector = RepeatDetector()
    assert not detector.is_repeated(frames()[0], S)
    detector.keep(frames()[0])
    assert detector.is_repeated(frames()[0], S)
    assert not detector.is_repeated(other(frames()[0]), S)
    assert not detector.is_repeated(frames()[0], S, encoding='rgb8')


def test_more_than_8_bits_are_repeated_only_if_they_are_the_same():
    frame = (257 * frames()[0].astype(np.uint16))
    detector = RepeatDetector()
    detector.keep(frame.copy())
    frame[10, 10] ^= 1
    assert not detector.is_repeated(frame, S)


def test_a_covered_lens_is_not_a_frozen_camera():
    estimator = TrajectoryEstimator(AUTO)
    black = np.zeros((240, 320), np.uint8)
    updates = [estimator.update(black, index * S // 10) for index in range(30)]
    assert {update.status for update in updates[1:]} == {PairStatus.NO_MEASUREMENT}
    assert Reason.FROZEN not in estimator.reliability.reasons
