# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Codes from turns mask fixed areas, restart at cuts, and report doubts."""

from collections import Counter

import cv2
from kitti import grey_pictures
import motorway
import numpy as np
import overlays
from phase_traj_ros.core import (
    CameraEstimate,
    CodeSource,
    EstimatorSettings,
    Lens,
    PairStatus,
    PathSource,
    StillnessSettings,
    TrajectoryEstimator,
    View,
)
from phase_traj_ros.core.codes.threshold_hint import Misfit
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.camera import EQUIDISTANT
from phase_traj_ros.synthetic.degradations import night, sensor_noise
import pytest

HFOV_DEG = 70.0
KNOWN = Lens(hfov_deg=HFOV_DEG)
TENTH = 100_000_000


def drive_of(seed, *plan, rate_hz=10.0):
    return list(render_drive(plan_drive(
        'a drive', list(plan), rate_hz=rate_hz, speed=6.0, seed=seed,
        camera=Camera.with_field_of_view(320, 240, HFOV_DEG))))


@pytest.fixture(scope='module')
def drive():
    return drive_of(8, Straight(2.0), Turn(-90.0, 3.0, 4.5), Straight(1.0))


@pytest.fixture(scope='module')
def other():
    return drive_of(3, Straight(1.0), Turn(90.0, 3.0, 4.5), Straight(1.5))


def followed(frames, *, source=CodeSource.AUTO, lens=KNOWN, period_ns=TENTH, **settings):
    """Return the estimator after the frames, the result of each pair, and the angles of turns."""
    estimator = TrajectoryEstimator(EstimatorSettings(code_source=source, lens=lens, **settings))
    updates = [estimator.update(frame, n * period_ns) for n, frame in enumerate(frames)][1:]
    turns = [*estimator.turns, *estimator.heading.finish()] if estimator.heading else []
    return estimator, updates, [turn.angle_deg for turn in turns]


def statuses(updates):
    return Counter(update.status for update in updates)


OVERLAYS = {
    'bars': (lambda frame, n: overlays.black_bars(frame, sides=0.15), 0.30),
    'letterbox': (lambda frame, n: overlays.black_bars(frame, ends=0.12), 0.24),
    'bonnet': (lambda frame, n: overlays.bonnet(frame), 0.17),
    'text': (lambda frame, n: overlays.burnt_in_text(
        frame, f'2026-03-01 12:34:{n // 10:02} 53.5N 9.9E FRONT'), 0.02),
    'drops': (lambda frame, n: overlays.drops(frame, count=50, size=0.015, softness=0.1), 0.06),
}


@pytest.mark.parametrize('name', OVERLAYS)
def test_what_is_fixed_is_found_left_out_and_no_harm(drive, name):
    spoil, share = OVERLAYS[name]
    frames = [spoil(frame, number) for number, frame in enumerate(drive)]
    estimator, updates, angles = followed(frames)
    assert estimator.left_out.shape == frames[0].shape
    assert 0.6 * share < np.mean(estimator.left_out == 0) < 1.6 * share + 0.06
    assert angles == pytest.approx([-90.0], abs=8.0)
    assert estimator.reliability.reliable
    assert statuses(updates)[PairStatus.NO_MEASUREMENT] < 0.05 * len(updates)


def test_nothing_is_left_out_of_clear_pictures(drive):
    estimator, updates, _ = followed(drive)
    assert estimator.left_out is None
    assert set(statuses(updates)) <= {PairStatus.OK, PairStatus.TURNING}


def test_where_only_drops_agree_the_turn_is_not_measured_and_the_drive_is_in_doubt(drive):
    frames = [overlays.drops(frame, count=400, size=0.025, seed=2) for frame in drive]
    estimator, updates, _ = followed(frames)
    # It turns from 2.0 to 5.0 s. Drops that rest in all of the picture may look like a stop.
    turn = statuses(updates[25:45])
    assert set(turn) <= {PairStatus.NO_MEASUREMENT, PairStatus.STILL}
    assert turn[PairStatus.NO_MEASUREMENT] >= 15
    assert estimator.reliability.words == ('view_blocked', 'road_unclear')
    # The codes from the heading, which are unchanged, would not show it.
    _, updates, _ = followed(frames, source=CodeSource.HEADING)
    assert statuses(updates)[PairStatus.OK] > 0.8 * len(updates)


@pytest.mark.parametrize(('grain', 'lens', 'seconds'), [(0.01, KNOWN, 5.0), (0.08, None, 3.0)])
def test_a_horizon_that_does_not_move_is_neither_dirt_nor_a_stop(grain, lens, seconds):
    """Of a straight motorway without much texture, little of the picture changes at all."""
    frames = motorway.driven(grain=grain, seconds=seconds)[2]
    estimator, updates, turns = followed(
        frames, lens=lens, period_ns=40_000_000, stillness=StillnessSettings())
    assert statuses(updates)[PairStatus.OK] == len(updates)
    assert turns == [] and estimator.reliability.reliable
    assert estimator.left_out is None
    # The same road through a wet windscreen, and from a car that stands on it: that takes
    # half a second to tell, and stays so when what has not changed for 2 s is judged.
    wet = [overlays.drops(frame, count=400, size=0.025, seed=2) for frame in frames[:60]]
    stood = [sensor_noise(frames[0], sigma=1.0, seed=n) for n in range(60)]
    for shown in (wet, stood):
        _, updates, _ = followed(
            shown, lens=lens, period_ns=40_000_000, stillness=StillnessSettings())
        assert statuses(updates)[PairStatus.OK] < 14


@pytest.mark.parametrize('upside_down', [False, True])
def test_a_horizon_is_above_the_road_however_the_camera_is_mounted(upside_down):
    frames = motorway.driven(grain=0.03, seconds=4.0)[2]
    if upside_down:
        frames = [np.ascontiguousarray(frame[::-1, ::-1]) for frame in frames]
    _, updates, _ = followed(
        frames, period_ns=40_000_000, stillness=StillnessSettings(), path_from=PathSource.CODES,
        view=View(rotate_180=upside_down))
    assert statuses(updates)[PairStatus.OK] == len(updates)


@pytest.mark.parametrize('rate_hz', [10, 60])
def test_a_vehicle_does_not_stop_where_markings_alone_show_that_it_drives(rate_hz):
    frames = motorway.driven(grain=0.01, seconds=3.0, speed=12.0, rate_hz=rate_hz)[2]
    estimator, updates, _ = followed(
        frames, period_ns=10**9 // rate_hz, stillness=StillnessSettings(), camera_height=1.3)
    assert statuses(updates)[PairStatus.STILL] == 0
    assert estimator.way.distance == pytest.approx(12.0 * len(updates) / rate_hz, rel=0.03)


@pytest.fixture(scope='module')
def circles():
    camera = Camera.with_field_of_view(160, 120, 150, above_ground=1.5, fisheye=EQUIDISTANT)
    plan = [Straight(0.5), Turn(2 * 360.0, 9.0), Straight(0.5)]
    return list(render_drive(plan_drive(
        '', plan, rate_hz=20.0, camera=camera, speed=8.0, seed=4)))


@pytest.mark.parametrize('contrast', [1.0, 0.1])
def test_a_model_car_in_circles_does_not_stand_because_its_bumper_does(circles, contrast):
    """A strong fisheye, 80 degrees a second: within 10 %, or said; the bumper has most texture."""
    frames = [
        overlays.bonnet(np.rint(128 + contrast * (frame - 128.0)).astype(np.uint8), height=0.25)
        for frame in circles]
    frames = [sensor_noise(frame, sigma=4.0, seed=n) for n, frame in enumerate(frames)]
    estimator, updates, _ = followed(
        frames, lens=None, period_ns=50_000_000, stillness=StillnessSettings())
    turned = np.degrees(updates[-1].heading.heading)
    assert turned == pytest.approx(2 * 360.0, rel=0.1) or not estimator.reliability.reliable
    assert statuses(updates)[PairStatus.STILL] < 0.1 * len(updates)


def test_a_night_without_light_is_no_measurement(drive):
    frames = [night(frame, exposure=0.0005, seed=n) for n, frame in enumerate(drive[:30])]
    estimator, updates, _ = followed(frames)
    assert statuses(updates)[PairStatus.NO_MEASUREMENT] == len(updates)
    assert estimator.reliability.words == ('nothing_to_see',)


def test_a_film_in_scenes_is_one_drive_with_no_turn_at_the_cuts(drive, other):
    straight = drive[:18]
    film = [*straight, *other, *straight, *drive]
    estimator, updates, angles = followed(film)
    cuts = [len(straight), len(straight) + len(other), 2 * len(straight) + len(other)]
    assert [update.pair for update in updates if update.cut] == cuts
    assert [updates[cut - 1].status for cut in cuts] == [PairStatus.NO_MEASUREMENT] * 3
    assert angles == pytest.approx([90.0, -90.0], abs=8.0)
    moved = [int(update.step.movement) for update in updates]
    assert [code for code in moved if code in (0, 2)] == [0, 2]
    headings = np.degrees([update.heading.heading for update in updates])
    # Earlier results are kept, and a cut between scenes adds nothing.
    assert headings[cuts[1] - 2] == pytest.approx(90.0, abs=8.0)
    assert abs(headings[cuts[1] + 1] - headings[cuts[1] - 2]) < 3.0
    assert estimator.reliability.reliable


def test_a_turn_ends_where_the_film_is_cut(drive, other):
    turning, onward = drive[:39], other[25:]
    _, updates, _ = followed([*turning, *onward])
    [cut] = [update for update in updates if update.cut]
    assert cut.pair == len(turning)
    [ended] = cut.turns
    assert ended.angle_deg == pytest.approx(-64.0, abs=8.0) and ended.end_frame <= cut.pair
    assert abs(cut.heading.rate) < np.radians(60.0) and not cut.heading.bridged


def test_two_halves_of_a_turn_are_no_turn_where_a_cut_is_between(drive):
    half = drive[:33]
    _, _, angles = followed([*half, *drive_of(5, Turn(-40.0, 1.4, 4.5), Straight(1.0))])
    assert angles == []


@pytest.mark.parametrize('source', [CodeSource.HEADING, CodeSource.SHIFT])
def test_other_codes_do_not_start_anew_nor_leave_anything_out(drive, other, source):
    film = [overlays.black_bars(frame, sides=0.15) for frame in [*drive, *other]]
    estimator, updates, _ = followed(film, source=source)
    assert estimator.left_out is None and not any(update.cut for update in updates)
    assert estimator.reliability.reliable


@pytest.mark.parametrize('source', [CodeSource.AUTO, CodeSource.SHIFT])
def test_a_crowd_about_a_hand_held_camera_is_not_reliable(drive, source):
    rng = np.random.default_rng(6)
    coats = [cv2.GaussianBlur(rng.integers(0, 255, (160, 50)).astype(np.uint8), (0, 0), 2)
             for _ in range(15)]

    def crowded(frame):
        frame = frame.copy()
        for coat in coats:
            left, top = rng.integers(0, 270), rng.integers(40, 80)
            frame[top:top + 160, left:left + 50] = coat
        turn = cv2.getRotationMatrix2D((160, 120), rng.normal(0, 5), 1.1)
        turn[:, 2] += rng.normal(0, 20, 2)
        return cv2.warpAffine(frame, turn, (320, 240), borderMode=cv2.BORDER_REFLECT)

    lens = KNOWN if source is CodeSource.AUTO else None
    estimator, _, _ = followed(
        [crowded(frame) for frame in drive], source=source, lens=lens, period_ns=5 * TENTH)
    assert set(estimator.reliability.words) >= {'not_one_motion', 'rate_too_low'}


def narrow(deviation):
    return Lens(estimate=CameraEstimate(
        width=320, height=240, focal_px=228.5, focal_deviation=deviation))


@pytest.mark.parametrize(('lens', 'words'), [
    (KNOWN, ()), (Lens(hfov_deg=HFOV_DEG, assumed=True), ('camera_not_known',)),
    (narrow(0.05), ()), (narrow(0.2), ('camera_not_known',))])
def test_a_camera_has_to_be_known_where_there_are_turns(drive, lens, words):
    estimator, _, _ = followed(drive, lens=lens)
    assert estimator.reliability.words == words
    estimator, _, _ = followed(drive[:18], lens=lens)
    assert estimator.reliability.reliable


def test_a_bend_that_may_have_been_a_turn_needs_a_camera_too():
    frames = drive_of(2, Straight(0.5), Turn(64.0, 3.0), Straight(1.0))
    for narrower_deg, words in ((40.0, ('camera_not_known',)), (30.0, ())):
        lens = Lens(hfov_deg=narrower_deg, assumed=True)
        estimator, _, angles = followed(frames, lens=lens)
        assert angles == [] and estimator.reliability.words == words
    assert followed(frames, lens=KNOWN)[0].reliability.reliable


@pytest.mark.parametrize('seed', [2, 4])
def test_a_bend_contradicts_a_lens_that_is_far_too_narrow(seed):
    # A fit that starts at the given lens may stay there.
    frames = drive_of(seed, Straight(0.5), Turn(64.0, 3.0), Straight(1.0))
    estimator, _, _ = followed(frames, lens=Lens(hfov_deg=40.0))
    assert estimator.reliability.words == ('camera_contradicted',)


def test_a_slow_corner_of_a_robot_is_one_turn_with_one_code():
    frames = drive_of(
        6, Straight(2.0, 0.5), Turn(-90.0, 25.0, 0.5), Straight(2.0, 0.5), rate_hz=2.5)
    estimator, updates, angles = followed(frames, period_ns=4 * TENTH)
    assert angles == pytest.approx([-90.0], abs=8.0)
    moved = [int(update.step.movement) for update in updates]
    assert [code for code in moved if code in (0, 2)] == [2]
    assert estimator.reliability.reliable


def test_two_bends_that_are_no_turns_leave_the_direction_in_doubt():
    frames = drive_of(
        2, Straight(0.5), Turn(48.0, 2.0), Straight(3.0), Turn(48.0, 2.0), Straight(4.0))
    estimator, updates, angles = followed(frames)
    assert angles == []
    assert estimator.reliability.words == ('direction_contradicts_heading',)
    [span] = estimator.reliability.spans
    assert span.start_ns > 65 * TENTH
    assert span.end_ns == updates[-1].stamp_ns


def test_the_paper_s_rule_needs_no_camera(drive):
    estimator, _, _ = followed(
        drive, source=CodeSource.SHIFT, lens=Lens(hfov_deg=HFOV_DEG, assumed=True))
    assert estimator.reliability.reliable


def test_standing_is_asked_for_before_anything_is_doubted(drive):
    """Traffic in a part of the view is doubted only if the vehicle moves."""
    rng = np.random.default_rng(2)
    lorry = cv2.GaussianBlur(rng.integers(0, 255, (90, 700)).astype(np.uint8), (0, 0), 3)

    def standing(number):
        frame = drive[0].copy()
        # Where less than this changes, nothing is doubted in any case.
        frame[170:240] = lorry[:70, 4 * number:4 * number + 320]
        noise = rng.normal(0, 1.5, frame.shape)
        return np.clip(frame + noise, 0, 255).astype(np.uint8)

    frames = [standing(number) for number in range(80)]
    assert statuses(followed(frames)[1])[PairStatus.NO_MEASUREMENT] > 0
    estimator, updates, _ = followed(frames, stillness=StillnessSettings())
    assert statuses(updates)[PairStatus.STILL] > 0.8 * len(updates)
    assert estimator.reliability.reliable


def with_noise(frames):
    return [sensor_noise(frame, sigma=1.5, seed=number) for number, frame in enumerate(frames)]


@pytest.fixture(scope='module')
def ahead():
    return drive_of(8, Straight(6.0, 9.0))


@pytest.mark.parametrize(('contrast', 'pairs'), [(1.0, 15), (0.15, 5)])
def test_a_cover_that_comes_over_the_view_is_not_a_stop(ahead, contrast, pairs):
    """Mud, snow from the roof, or a bag: it hides the scene within seconds, and stays."""
    mud = cv2.GaussianBlur(
        np.random.default_rng(4).normal(size=ahead[0].shape), (0, 0), 4)
    mud = 110.0 + contrast * 50.0 / mud.std() * mud
    shares = np.clip((np.arange(len(ahead)) - 15) / pairs, 0.0, 1.0)
    estimator, updates, _ = followed(with_noise(
        ((1.0 - share) * frame + share * mud).astype(np.uint8)
        for frame, share in zip(ahead, shares)))
    assert not estimator.reliability.of_drive.reliable
    assert 'view_blocked' in estimator.reliability.of_drive.words
    assert PairStatus.STILL not in statuses(updates)


def test_a_stop_is_not_a_cover_that_comes_over_the_view():
    frames = with_noise(drive_of(8, Straight(1.5, 9.0), Straight(4.5, 0.0)))
    estimator, updates, _ = followed(frames)
    assert estimator.reliability.of_drive.reliable
    assert statuses(updates[30:])[PairStatus.STILL] == len(updates[30:])


def test_a_reset_keeps_what_is_fixed_and_forgets_what_was_in_doubt(drive):
    barred = [overlays.black_bars(frame, sides=0.15) for frame in drive]
    estimator, _, _ = followed([*barred, *[np.zeros_like(barred[0])] * 200])
    assert estimator.reliability.words == ('nothing_to_see',)
    estimator.reset()
    assert np.mean(estimator.left_out == 0) > 0.2
    for number, frame in enumerate(barred[:15]):
        estimator.update(frame, 10**12 + number * TENTH)
    assert estimator.reliability.reliable and estimator.reliability.start_ns == 10**12


def test_the_hint_is_about_the_paper_s_rule(drive):
    estimator, _, _ = followed(drive, source=CodeSource.SHIFT, lens=None, threshold=40.0)
    hint = estimator.threshold_hint
    assert hint.misfit is Misfit.TOO_HIGH and 4.0 < hint.suggested_px < 12.0
    estimator.reset()
    assert estimator.threshold_hint is None
    estimator, _, _ = followed(
        drive, source=CodeSource.SHIFT, lens=None, threshold=hint.suggested_px)
    assert estimator.threshold_hint is None
    assert followed(drive, threshold=40.0)[0].threshold_hint is None


@pytest.mark.parametrize(('name', 'every'), [('00', 1), ('00', 3), ('06', 1)])
def test_real_driving_is_reliable(kitti_root, name, every):
    frames = grey_pictures(kitti_root / name)[::every]
    estimator, updates, _ = followed(
        frames, lens=Lens(focal_px=718.856), period_ns=every * TENTH)
    assert estimator.reliability.reliable and estimator.left_out is None
    assert not any(update.cut for update in updates)
    assert PairStatus.NO_MEASUREMENT not in statuses(updates)
