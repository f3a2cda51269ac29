# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The roll of the camera, from its changes and from turns."""

from itertools import pairwise
import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.camera_roll import CameraRoll
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.yaw_meter import YawMeter
import pytest

#: Yaw rate in radians per second.
RATE = 0.5


def moved(yaw, pitch, roll):
    """Return the motion of a camera that these angles turn, in radians."""
    return CameraMotion(yaw, pitch, roll, FocusOfExpansion(), 100.0, 0.9, 1e-8, 0.1)


def driven(rolls, rate_hz, *, estimate=None, yaw_rate=RATE, rng=None):
    """
    Return the estimate after a bend with these rolls of the camera, in radians.

    With ``rng``, the vehicle nods at random.
    """
    estimate, interval = estimate or CameraRoll(Horizon()), 1.0 / rate_hz
    for before, roll in pairwise(rolls.tolist()):
        # The rates of a camera that turns about the vertical axis, and rolls, and nods.
        yaw = yaw_rate * interval * math.cos(roll)
        nod = 0.0 if rng is None else rng.normal(0.0, TUNING.pitch_walk * math.sqrt(interval))
        estimate.predict(interval)
        estimate.add(
            moved(yaw, -yaw * math.tan(roll) + nod, roll - before), interval, Mounting())
    return estimate


def leaning(seconds, *, pitch_deg=0.0, azimuth_deg=0.0, side=1, interval=0.05):
    """
    Return the estimate, the true roll and the error of the heading after a part of a corner.

    The camera points down and aside on a bicycle that leans to the inside by 18 degrees. The
    motions are those of rotation matrices.
    """
    # Body axes: x ahead, y left, z up; image axes: x right, y down, z ahead.
    body = cv2.Rodrigues(np.array([0.0, math.radians(pitch_deg), 0.0]))[0] @ cv2.Rodrigues(
        np.array([0.0, 0.0, math.radians(azimuth_deg)]))[0]
    to_image = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]) @ body.T
    travel = to_image @ (1.0, 0.0, 0.0)
    mounting = Mounting()
    mounting.angle = math.atan2(travel[0], travel[2])
    mounting.slope = travel[1] / math.hypot(travel[0], travel[2])
    before, found = None, 0.0
    for time in np.arange(0.0, seconds, interval):
        lean = -side * math.radians(18.0) * np.interp(time, (1, 2, 5, 6), (0.0, 1.0, 1.0, 0.0))
        heading = side * np.interp(time, (1, 6), (0.0, 1.0)) * RATE
        attitude = cv2.Rodrigues(np.array([0.0, 0.0, heading]))[0] @ cv2.Rodrigues(
            np.array([lean, 0.0, 0.0]))[0] @ to_image.T
        downwards = -attitude.T @ (0.0, 0.0, 1.0)
        roll = math.atan2(downwards[0], downwards[1])
        if before is None:
            estimate = CameraRoll(Horizon(roll=roll))
        else:
            right, down, ahead = cv2.Rodrigues(before.T @ attitude)[0][:, 0]
            estimate.predict(interval)
            swung = estimate.add(moved(-down, right, ahead), interval, mounting)
            found += (-down - swung) / (math.cos(estimate.current) * mounting.level)
        before = attitude
    return estimate, roll, found - heading


@pytest.mark.parametrize('pitch_deg', [-8.0, 5.0, 12.0])
@pytest.mark.parametrize('yaw_rate', [0.3, 0.5, 2.0])
@pytest.mark.parametrize('rate_hz', [5, 10, 60])
def test_a_long_turn_of_a_camera_with_an_unknown_pitch_is_no_lean(pitch_deg, yaw_rate, rate_hz):
    # Three turns of a car park: no straight has shown the pitch.
    pitch, interval, turned, truth = math.radians(pitch_deg), 1 / rate_hz, 0.0, 6 * math.pi
    estimate, mounting = CameraRoll(Horizon()), Mounting()
    for _ in range(round(truth / yaw_rate / interval)):
        yaw = yaw_rate * interval * math.cos(pitch)
        estimate.predict(interval)
        estimate.add(moved(yaw, 0.0, -yaw * math.tan(pitch)), interval, mounting)
        turned += yaw / math.cos(estimate.current)
        assert abs(math.degrees(estimate.current)) < 20.0
    assert turned == pytest.approx(truth, rel=0.03)


@pytest.mark.parametrize('rate_hz', [10, 60])
def test_the_shaking_of_a_camera_with_an_unknown_pitch_is_no_lean(rate_hz):
    rng, estimate, interval = np.random.default_rng(2), CameraRoll(Horizon()), 1 / rate_hz
    shakes = np.radians(rng.normal(0.0, (2.0, 1.0, 1.0), (20 * rate_hz, 3)))
    rolls = []
    for yaw, pitch, roll in np.diff(shakes, axis=0).tolist():
        estimate.predict(interval)
        estimate.add(moved(yaw + 0.3 * interval, pitch, roll), interval, Mounting())
        rolls.append(math.degrees(estimate.current))
    assert np.abs(rolls).max() < 10.0


@pytest.mark.parametrize('rate_hz', [5, 60])
@pytest.mark.parametrize('yaw_rate', [RATE, -RATE])
def test_a_bend_tells_the_roll_of_the_mounting_at_any_rate(rate_hz, yaw_rate):
    roll = math.radians(5.0)
    estimate = driven(np.full(20 * rate_hz, roll), rate_hz, yaw_rate=yaw_rate)
    assert estimate.current == pytest.approx(roll, abs=math.radians(0.7))
    # Half of it may be the lean in the bend, by their priors; a straight tells.
    estimate = driven(np.full(60 * rate_hz, roll), rate_hz, estimate=estimate, yaw_rate=0.0)
    assert abs(estimate.current - estimate.mounting) < math.radians(0.1)
    assert estimate.mounting == pytest.approx(roll, abs=math.radians(2.5))


@pytest.mark.parametrize('rate_hz', [5, 60])
def test_it_errs_as_the_pitch_of_vehicles_makes_it(rate_hz):
    rng = np.random.default_rng(rate_hz)
    prior, count, seconds = Horizon().roll_deviation, 300, 3
    rolls = rng.normal(0.0, prior, count)
    found = [driven(np.full(seconds * rate_hz + 1, roll), rate_hz, rng=rng) for roll in rolls]
    error = np.std([each.current - roll for each, roll in zip(found, rolls)])
    # The lean is known to be 0 here, but not to the estimate.
    spread = math.hypot(prior, TUNING.lean_deviation)
    best = 1.0 / math.sqrt(prior ** -2 + seconds * (RATE / TUNING.pitch_walk) ** 2)
    assert best * 0.9 < error < 1.3 * best < spread


@pytest.mark.parametrize(
    ('pitch_deg', 'azimuth_deg'),
    [(0.0, 0.0), (10.0, 0.0), (-10.0, 0.0), (0.0, 15.0), (5.0, -15.0)])
@pytest.mark.parametrize('side', [1, -1])
def test_a_bicycle_leans_in_a_turn_and_is_upright_again(pitch_deg, azimuth_deg, side):
    for seconds in (1.6, 3.5, 5.4, 8.0):
        estimate, roll, _ = leaning(
            seconds, pitch_deg=pitch_deg, azimuth_deg=azimuth_deg, side=side)
        assert estimate.current == pytest.approx(roll, abs=math.radians(1.0))


@pytest.mark.parametrize('seconds', [1.6, 2.1, 3.1, 5.6, 8.0])
def test_a_lean_is_found_at_two_frames_a_second(seconds):
    estimate, roll, _ = leaning(seconds, interval=0.5)
    assert estimate.current == pytest.approx(roll, abs=math.radians(0.6))


@pytest.mark.parametrize('seconds', [2.5, 4.5, 8.0])
@pytest.mark.parametrize('pitch_deg', [10.0, -10.0])
def test_the_lean_of_a_camera_that_points_up_or_down_is_no_turn(pitch_deg, seconds):
    *_, error = leaning(seconds, pitch_deg=pitch_deg)
    # It was 3 degrees, all of which came back at the end of the corner.
    assert error == pytest.approx(0.0, abs=math.radians(0.4))


def test_what_a_turn_tells_of_an_earlier_lean_is_no_motion():
    """With the change of the estimate, a model car's heading erred by a sixth more."""
    mounting, yaw = Mounting(Horizon(pitch=math.radians(10.0))), 0.1
    estimate = CameraRoll(Horizon())
    estimate.miss(1.0)
    swung = estimate.add(
        moved(yaw, yaw * math.tan(math.radians(18.0)), yaw * mounting.slope), 0.1, mounting)
    assert estimate.current < math.radians(-5.0)
    assert swung == pytest.approx(0.0, abs=1e-12)


def test_a_roll_that_is_taken_back_leaves_nothing():
    """The blocks of one frame are wrong: two pairs show opposite changes."""
    estimate = CameraRoll(Horizon())
    estimate.add(moved(0.1, 0.3, 0.2), 0.1, Mounting(), certain=False)
    assert estimate.current == 0.2
    estimate.add(moved(0.1, 0.0, -0.2), 0.1, Mounting())
    assert estimate.current == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('gap', [CameraRoll.forget_lean, lambda estimate: estimate.miss(1.0)])
def test_a_turn_tells_the_lean_after_a_gap(gap):
    estimate = driven(np.zeros(300), 10)
    lean = np.full(11, math.radians(-18.0))
    steady = driven(lean, 10, estimate=driven(np.zeros(300), 10))
    gap(estimate)
    found = driven(lean, 10, estimate=estimate)
    assert steady.current > math.radians(-8.0)
    assert found.current == pytest.approx(lean[0], rel=0.15)
    assert abs(found.mounting) < math.radians(1.0)
    # After a minute straight ahead, the vehicle is upright again, as without a gap.
    later, without = driven(np.zeros(300), 10), driven(np.zeros(300), 10)
    gap(later)
    for each in (later, without):
        driven(np.zeros(600), 10, estimate=each, yaw_rate=0.0)
        driven(lean, 10, estimate=each)
    assert later.current == pytest.approx(without.current, abs=math.radians(0.1))


@pytest.mark.parametrize('seconds', [60.0, 3600.0])
def test_a_gap_makes_no_roll_however_long_it_is(seconds):
    rng = np.random.default_rng(5)
    estimate = driven(np.zeros(300), 10)
    estimate.miss(seconds)
    # Of a straight road with the motions of a vehicle, 600 degrees of doubt made 70 of roll.
    for yaw_rate in np.radians(rng.normal(0.0, 1.0, 100)):
        driven(np.zeros(2), 10, estimate=estimate, yaw_rate=yaw_rate, rng=rng)
        assert abs(estimate.current) < math.radians(3.0)


def test_a_long_gap_leaves_no_lean_and_a_short_one_does():
    rolls = np.radians(-15.0) * np.clip(np.arange(30) / 10, 0.0, 1.0)
    for seconds, kept in ((0.1, 0.95), (1.0, 0.6), (30.0, 0.0)):
        estimate = driven(rolls, 10)
        lean = estimate.current - estimate.mounting
        estimate.miss(seconds)
        # On the straight after it, nothing tells the lean.
        assert estimate.current - estimate.mounting == pytest.approx(kept * lean, abs=0.01)


@pytest.mark.parametrize('rate_hz', [5, 30])
def test_a_car_is_no_bicycle_after_a_gap(rate_hz):
    rng = np.random.default_rng(2)
    for _ in range(20):
        estimate = CameraRoll(Horizon(roll_deviation=math.radians(1.0)))
        estimate.forget_lean()
        driven(np.zeros(3 * rate_hz), rate_hz, estimate=estimate, rng=rng)
        bank = np.radians(-5.0) * np.clip(np.arange(2 * rate_hz) / rate_hz, 0.0, 1.0)
        driven(bank, rate_hz, estimate=estimate)
        assert estimate.on_road == estimate.mounting


def test_another_lens_does_not_tell_the_lean():
    estimate = driven(np.zeros(300), 10)
    estimate.forget_lean()
    lean = np.full(31, math.radians(-18.0))
    found = driven(lean, 10, estimate=estimate.with_mounting(Horizon()))
    assert found.current == pytest.approx(lean[0], rel=0.1)
    # It was 4 degrees.
    assert abs(found.mounting) < math.radians(2.0)


def test_a_camera_that_shakes_has_no_roll():
    """Yaws and nods of a handlebar on a straight seemed to be a turn with a roll of 5 degrees."""
    rng, interval = np.random.default_rng(3), 1 / 60
    estimate = CameraRoll(Horizon())
    yaws, pitches = np.diff(np.radians([[0.2], [0.4]]) * rng.normal(size=(2, 1200)), axis=1)
    for yaw, pitch in zip(yaws, pitches):
        estimate.predict(interval)
        estimate.add(moved(yaw, pitch, 0.0), interval, Mounting())
        assert abs(estimate.current) < math.radians(2.0)


def test_a_turn_goes_on_where_the_blocks_fail_and_with_another_lens():
    turning = driven(np.zeros(30), 10)
    rate = turning.yaw_rate
    assert rate == pytest.approx(RATE, rel=0.01)
    assert turning.with_mounting(Horizon()).yaw_rate == rate
    turning.miss(1.0, RATE)
    assert turning.yaw_rate == pytest.approx(rate, rel=0.01)
    turning.miss(1.0)
    assert abs(turning.yaw_rate) < 0.05 * RATE
    driven(np.zeros(30), 10, estimate=turning)
    turning.forget_lean()
    assert turning.yaw_rate == 0.0


@pytest.mark.parametrize('side', [1, -1])
def test_a_wrong_yaw_where_the_blocks_fail_begins_no_turn(side):
    straight = driven(np.zeros(30), 10, yaw_rate=0.0)
    straight.miss(0.1, side * 0.3)
    assert straight.yaw_rate == pytest.approx(0.0, abs=1e-9)
    for wrong in (0.3, -0.3):
        turning = driven(np.zeros(30), 10, yaw_rate=side * RATE)
        rate = turning.yaw_rate
        turning.miss(0.1, wrong)
        assert turning.yaw_rate == pytest.approx(
            rate if wrong * side > 0.0 else rate * math.exp(-0.1 / TUNING.yaw_rate_s))


def test_a_nod_in_a_turn_is_no_roll():
    estimate = driven(np.zeros(20), 10)
    yaw = 0.1 * RATE
    estimate.predict(0.1)
    estimate.add(moved(yaw, math.radians(1.5), 0.0), 0.1, Mounting())
    assert abs(estimate.current) < math.radians(1.0)


def test_a_mounting_that_was_knocked_is_found_again():
    estimate, knocked = CameraRoll(Horizon()), math.radians(6.0)

    def blocks(minutes, roll):
        """Drive around a corner to the left and one to the right each minute."""
        for _ in range(minutes):
            for yaw_rate in (RATE, -RATE):
                driven(np.full(31, roll), 10, estimate=estimate, yaw_rate=yaw_rate)
                driven(np.full(271, roll), 10, estimate=estimate, yaw_rate=0.0)

    blocks(60, 0.0)
    blocks(20, knocked)
    assert estimate.mounting == pytest.approx(knocked, rel=0.4)


@pytest.mark.parametrize('side', [1, -1])
def test_a_car_in_a_bend_that_is_banked_is_level_on_the_road(side):
    bank = np.radians(-5.0 * side) * np.clip(np.arange(40) / 10, 0.0, 1.0)
    estimate = driven(bank, 10, yaw_rate=side * RATE, estimate=driven(np.zeros(60), 10))
    assert estimate.current == pytest.approx(bank[-1], abs=math.radians(0.5))
    assert estimate.on_road == estimate.mounting == pytest.approx(0.0, abs=math.radians(0.5))
    # The other way, it is the car that leans on its springs.
    springs = driven(-bank / 2, 10, yaw_rate=side * RATE)
    assert springs.on_road == springs.current


@pytest.mark.parametrize('side', [1, -1])
@pytest.mark.parametrize('gap', [CameraRoll.forget_lean, lambda estimate: estimate.miss(1.0)])
def test_the_roll_of_a_mounting_that_is_not_known_is_no_bank(gap, side):
    estimate, roll = CameraRoll(Horizon()), np.full(25, math.radians(6.0))
    gap(estimate)
    driven(roll, 10, yaw_rate=side * RATE, estimate=estimate)
    assert estimate.on_road == pytest.approx(roll[0], abs=math.radians(1.0))


def test_a_picture_that_turns_on_a_straight_is_no_bicycle():
    turned = np.radians(12.0) * np.sin(np.linspace(0.0, np.pi, 20))
    estimate = driven(turned, 10, yaw_rate=0.0, estimate=driven(np.zeros(60), 10))
    bank = np.radians(-4.0) * np.clip(np.arange(40) / 10, 0.0, 1.0)
    driven(bank, 10, estimate=estimate)
    assert estimate.on_road == estimate.mounting


def test_a_bicycle_leans_relative_to_the_road():
    lean = np.radians(-15.0) * np.clip(np.arange(40) / 10, 0.0, 1.0)
    estimate = driven(lean, 10)
    assert estimate.on_road == estimate.current
    # From now on, less is a lean, too; with another lens as well.
    less = driven(np.linspace(lean[-1], lean[-1] / 3, 20), 10, estimate=estimate)
    assert less.on_road == less.current
    assert less.with_mounting(Horizon()).current == pytest.approx(less.current)
    known = Horizon(roll_deviation=math.radians(1.0))
    moved_on = driven(lean[:2], 10, estimate=less.with_mounting(known))
    assert moved_on.on_road == moved_on.current != moved_on.mounting


def test_a_long_bend_forgets_how_it_began():
    estimate = driven(np.zeros(3000), 10)
    # The road is banked by and by, so slowly that no pair shows it.
    estimate = driven(np.full(150, math.radians(-5.0)), 10, estimate=estimate)
    assert estimate.current == pytest.approx(math.radians(-5.0), abs=math.radians(1.0))


def test_it_is_bounded():
    estimate = CameraRoll(Horizon())
    for _ in range(20):
        estimate.add(moved(0.0, 0.0, 0.2), 0.1, Mounting())
    assert estimate.current == TUNING.max_roll


def test_another_lens_keeps_the_roll():
    camera = CameraModel(width=320, height=240, fx=200.0, fy=200.0, cx=159.5, cy=119.5)
    roll = CameraRoll(Horizon(), lean=-0.3)
    assert YawMeter(CylinderProjection(camera), roll=roll).roll.current == -0.3


def test_a_lean_without_a_turn_fades():
    time = np.arange(0.0, 60.0, 0.1)
    banked = np.radians(3.0) * np.minimum(time, 1.0)
    estimate = driven(banked, 10, yaw_rate=0.0)
    assert abs(estimate.current) < math.radians(0.1)


def test_only_the_lean_is_forgotten():
    estimate = driven(np.full(100, math.radians(5.0)), 10)
    mounting = estimate.mounting
    assert mounting > math.radians(2.0) and estimate.current - mounting > math.radians(0.5)
    estimate.forget_lean()
    assert estimate.current == estimate.mounting == mounting
    # What the next turn tells is as new for the lean as at the start.
    again = driven(np.full(100, math.radians(5.0)), 10, estimate=estimate)
    assert again.current == pytest.approx(math.radians(5.0), abs=math.radians(0.7))


def test_a_given_roll_is_hardly_changed_by_a_turn():
    roll = math.radians(4.0)
    given = CameraRoll(Horizon().with_given(roll_deg=1.0))
    unknown = CameraRoll(Horizon())
    rolls = np.full(31, roll)
    assert (driven(rolls, 10, estimate=given).mounting
            < driven(rolls, 10, estimate=unknown).mounting < roll)
