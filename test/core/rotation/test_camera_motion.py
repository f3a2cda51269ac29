# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Yaw from displacements, against an exact model of a camera that moves through points."""

from dataclasses import replace
import math

from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.core.rotation import camera_motion
from phase_traj_ros.core.rotation.camera_motion import MotionFit, quantile
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.tuning import TUNING
import pytest

DEVIATION = 0.25 / 256


def rotation(yaw, pitch, roll):
    """Return the camera's rotation, for the picture's axes (x right, y down, z forward)."""
    (sy, sp, sr), (cy, cp, cr) = (f((yaw, pitch, roll)) for f in (np.sin, np.cos))
    about_y = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    about_z = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    return about_y @ about_x @ about_z


class World:
    """Points all around, and what a camera sees of them before and after it has moved."""

    def __init__(self, seed=0, count=160, far=60.0):
        rng = np.random.default_rng(seed)
        self.azimuths = rng.uniform(-0.7, 0.7, count)
        self.slopes = rng.uniform(-0.3, 0.25, count)
        self.distances = rng.uniform(5.0, far, count)
        self.rng = rng

    def displacements(self, *, yaw, pitch=0.0, roll=0.0, step=0.0, course=0.0, climb=0.0):
        points = self.distances * np.stack(
            [np.sin(self.azimuths), self.slopes, np.cos(self.azimuths)])
        moved = step * np.array([math.sin(course), climb, math.cos(course)])
        # What the camera has turned by, the points turn back by.
        seen = rotation(yaw, pitch, roll).T @ (points - moved[:, None])
        u = np.arctan2(seen[0], seen[2]) - self.azimuths
        w = seen[1] / np.hypot(seen[0], seen[2]) - self.slopes
        return u, w

    def fit(self, *, reverses=True, **motion):
        u, w = self.displacements(**motion)
        fit = MotionFit(self.azimuths, self.slopes, deviation=DEVIATION)
        return fit(u, w, np.ones_like(u), FocusOfExpansion(), reverses=reverses)


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.08, 0.08), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01),
       st.floats(-1.2, 1.2), st.floats(-0.06, 0.06))
def test_finds_the_yaw_whatever_the_distances(yaw, pitch, roll, step, course):
    motion = World().fit(yaw=yaw, pitch=pitch, roll=roll, step=step, course=course)
    # A short step in reverse is hardly told from none.
    assert motion.yaw == pytest.approx(yaw, abs=0.03 * abs(yaw) + (8e-4 if step < 0.0 else 3e-4))


def test_left_is_positive_and_the_rest_is_right_too():
    motion = World().fit(yaw=0.05, pitch=0.006, roll=-0.004, step=1.0, course=0.04)
    assert motion.yaw == pytest.approx(0.05, abs=5e-4)
    assert motion.pitch == pytest.approx(0.006, abs=5e-4)
    assert motion.roll == pytest.approx(-0.004, abs=8e-4)
    # Half-way between the frames, half of the yaw is done.
    assert motion.travel.course == pytest.approx(0.04 + 0.05 / 2, abs=0.005)
    assert motion.agreement > 0.9


def overtaken(travel, *, side=1.0, sign=1.0, gain=0.01):
    """Return the yaw that fits a straight step, while what is far on one side recedes."""
    world = World(count=300)
    u, w = world.displacements(yaw=0.0, step=sign)
    lane = (side * world.azimuths > 0.15) & (np.abs(world.slopes) < 0.1)
    along = np.sin(world.azimuths), world.slopes * np.cos(world.azimuths)
    moved = [np.where(lane, -sign * gain * each, still) for each, still in zip(along, (u, w))]
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    return fit(*moved, np.ones_like(u), travel).yaw


@pytest.mark.parametrize('side', [-1.0, 1.0])
@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_vehicles_that_overtake_on_one_side_turn_the_camera_little(side, sign):
    """They recede; in reverse, those that follow faster come nearer."""
    straight = FocusOfExpansion(course_variance=TUNING.course_deviation ** 2)
    for gain, limit in ((0.005, 7e-4), (0.01, 7e-4), (0.02, 5e-5)):
        assert abs(overtaken(straight, side=side, sign=sign, gain=gain)) < limit


def test_what_recedes_counts_where_the_course_is_not_known():
    slipping = FocusOfExpansion(course_variance=(10.0 * TUNING.course_deviation) ** 2)
    assert abs(overtaken(slipping)) > 1e-3


@pytest.mark.parametrize('step', [0.3, 1.0])
def test_in_reverse_all_is_the_same_but_the_sign_of_what_passes(step):
    turn = {'yaw': 0.02, 'pitch': 0.006, 'roll': -0.004, 'course': 0.04}
    forward, back = World().fit(step=step, **turn), World().fit(step=-step, **turn)
    for found in (forward, back):
        assert found.yaw == pytest.approx(0.02, abs=5e-4)
        assert found.travel.course == pytest.approx(0.04 + 0.02 / 2, abs=0.01)
        assert found.agreement > 0.9
    assert back.passing == pytest.approx(forward.passing, rel=0.1)
    assert back.near == pytest.approx(-forward.near, rel=0.1)
    refused = World().fit(step=-step, reverses=False, **turn)
    assert refused.near >= 0.0 and refused.agreement < 0.5


@pytest.mark.parametrize(('pitch', 'roll'), [(0.02, 0.0), (-0.02, 0.0), (0.0, 0.02)])
def test_pitch_and_roll_are_no_yaw_even_if_only_a_corner_of_the_view_shows_something(pitch, roll):
    world = World()
    world.azimuths = world.rng.uniform(0.2, 0.8, 160)
    world.slopes = world.rng.uniform(0.1, 0.4, 160)
    motion = world.fit(yaw=0.01, pitch=pitch, roll=roll)
    assert motion.yaw == pytest.approx(0.01, abs=1e-3)
    assert (motion.pitch, motion.roll) == pytest.approx((pitch, roll), abs=1e-3)


def test_the_mean_displacement_alone_would_be_wrong():
    # Houses near by on the right, far ones on the left.
    world = World()
    world.distances = np.where(world.azimuths > 0, 6.0, 60.0)
    u, _ = world.displacements(yaw=0.01, step=1.0)
    assert abs(np.median(u) - 0.01) > 0.003
    assert world.fit(yaw=0.01, step=1.0).yaw == pytest.approx(0.01, abs=3e-4)


def test_other_traffic_does_not_matter():
    world = World()
    u, w = world.displacements(yaw=-0.03, step=0.8)
    u[:40] += 0.05
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    motion = fit(u, w, np.ones_like(u), FocusOfExpansion())
    assert motion.yaw == pytest.approx(-0.03, abs=1e-3)
    assert motion.agreement == pytest.approx(0.75, abs=0.05)


@pytest.mark.parametrize(('moving', 'reverses'), [(140, True), (72, False)])
def test_a_leader_that_pulls_away_from_a_scene_at_rest_is_not_reverse(moving, reverses):
    world = World()
    u, w = world.displacements(yaw=0.0, step=-1.0)
    u[moving:], w[moving:] = 0.0, 0.0
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    motion = fit(u, w, np.ones_like(u), FocusOfExpansion())
    # What rests agrees with reverse, too: it may be far away.
    assert (motion.near < 0.0) == reverses


def test_few_blocks_that_recede_are_not_reverse():
    world = World()
    u, w = world.displacements(yaw=0.0, step=-1.0)
    astray = world.rng.uniform(-0.2, 0.2, (2, 120))
    for many, reverses in ((60, True), (120, False)):
        across, down = u.copy(), w.copy()
        across[:many], down[:many] = astray[:, :many]
        fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
        motion = fit(across, down, np.ones_like(u), FocusOfExpansion())
        assert (motion is not None and motion.near < 0.0) == reverses


@pytest.mark.parametrize('mirrored', [False, True])
@pytest.mark.parametrize('seed', range(3))
def test_traffic_and_roadside_of_a_motorway_are_not_a_turn(seed, mirrored):
    # Hills ahead and on the left, faster traffic below them, and a roadside on the right only.
    rng = np.random.default_rng(seed)
    world = World()
    world.azimuths = np.concatenate([
        np.linspace(-0.45, 0.2, 30), np.linspace(-0.4, -0.1, 16), np.linspace(0.1, 0.45, 24)])
    world.slopes = np.concatenate([
        rng.uniform(-0.03, 0.0, 30), np.full(16, 0.07), rng.uniform(-0.2, 0.1, 24)])
    world.distances = np.concatenate([np.full(46, 400.0), rng.uniform(20.0, 60.0, 24)])
    u, w = world.displacements(yaw=0.0, step=5.0)
    u[30:46] += rng.uniform(0.008, 0.03, 16)
    u, w = (each + rng.normal(0.0, DEVIATION, len(u)) for each in (u, w))
    if mirrored:
        world.azimuths, u = -world.azimuths, -u
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    motion = fit(u, w, np.ones_like(u), FocusOfExpansion())
    assert motion.yaw == pytest.approx(0.0, abs=math.radians(0.2))
    assert motion.travel.course == pytest.approx(0.0, abs=math.radians(1.5))


def test_noise_averages_out():
    world = World()
    u, w = world.displacements(yaw=0.02, step=0.8)
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    noises = world.rng.normal(0, DEVIATION, (30, 2, len(u)))
    noisy = [
        fit(u + across, w + down, np.ones_like(u), FocusOfExpansion()).yaw
        for across, down in noises]
    assert np.mean(noisy) == pytest.approx(0.02, abs=2e-4)
    assert np.std(noisy) < DEVIATION


def test_standing_still_is_no_yaw():
    motion = World().fit(yaw=0.0)
    assert abs(motion.yaw) < 1e-6 and motion.agreement == 1.0


def test_weights_count_and_nothing_is_nothing():
    world = World()
    u, w = world.displacements(yaw=0.02, step=0.5)
    u[:100] = 0.3
    weight = np.ones_like(u)
    weight[:100] = 0.0
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    assert fit(u, w, weight, FocusOfExpansion()).yaw == pytest.approx(0.02, abs=5e-4)
    assert fit(u, w, np.zeros_like(u), FocusOfExpansion()) is None


@given(st.lists(st.floats(-9.0, 9.0), min_size=1, max_size=12), st.floats(0.0, 1.0))
def test_a_quantile_is_that_of_numpy(values, share):
    assert quantile(np.array(values), share) == pytest.approx(np.quantile(values, share))


def test_displacements_are_those_of_the_points_and_not_of_the_centres():
    world = World()
    u, w = world.displacements(yaw=0.02, pitch=0.003, step=0.5)
    aside, down = world.rng.normal(0.0, 0.02, (2, len(u)))
    at_points = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    at_centres = MotionFit(world.azimuths - aside, world.slopes - down, deviation=DEVIATION)
    one = at_points(u, w, np.ones_like(u), FocusOfExpansion())
    other = at_centres(u, w, np.ones_like(u), FocusOfExpansion(), aside=aside, down=down)
    assert (other.yaw, other.pitch, other.agreement) == pytest.approx(
        (one.yaw, one.pitch, one.agreement))


def test_a_motion_holds_with_enough_blocks_and_a_share_of_them(monkeypatch):
    world = World()
    motion = world.fit(yaw=0.02, step=0.5)
    assert motion.certain and motion.holds(motion.agreement)
    assert not motion.holds(motion.agreement + 0.01)
    for factor, holds in ((0.99, True), (1.01, False)):
        monkeypatch.setattr(camera_motion, 'TUNING', replace(
            TUNING, min_blocks=factor * motion.agreeing, doubted_share=1.1))
        assert motion.holds(0.1) is holds
        assert not motion.certain


def test_the_direction_of_travel_tends_to_straight_ahead():
    travel = FocusOfExpansion(course=0.1, course_variance=1e-6)
    later = travel.predict(0.1, 0.0, Mounting())
    settled = travel.predict(60.0, 0.0, Mounting())
    assert 0.08 < later.course < 0.1
    assert later.course_variance > travel.course_variance
    assert settled.course == pytest.approx(0.0, abs=1e-9)
    assert settled.course_variance == pytest.approx(FocusOfExpansion().course_variance)


def test_the_slope_of_the_travel_is_expected_to_stay_that_of_the_mounting():
    travel = FocusOfExpansion(slope=-0.02, slope_variance=1e-6)
    settled = travel.predict(60.0, 0.0, Mounting())
    assert settled.slope == pytest.approx(-0.02)
    assert settled.slope_variance == pytest.approx(FocusOfExpansion().slope_variance)


def test_a_camera_ahead_of_the_rear_axle_moves_sideways_in_a_turn():
    # 1.6 m ahead at 4 m/s and 40 degrees per second, after a straight.
    rate, interval = math.radians(40.0), 0.1
    straight = FocusOfExpansion(course=0.0, course_variance=math.radians(0.5) ** 2)
    world, errors = World(), []
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    u, w = world.displacements(yaw=rate * interval, step=0.4, course=-1.6 * rate / 4.0)
    expected = straight.predict(interval, rate, Mounting())
    for noise in world.rng.normal(0, DEVIATION, (20, 2, len(u))):
        motion = fit(u + noise[0], w + noise[1], np.ones_like(u), expected)
        errors.append(motion.yaw - rate * interval)
    assert abs(np.mean(errors)) < math.radians(0.1)


@pytest.mark.parametrize('turn', [1.0, -1.0])
def test_a_doubted_course_is_straight_ahead_or_towards_the_inside_of_the_turn(turn):
    mounting = Mounting()
    rate = turn * math.radians(40.0)
    # 1.6 m ahead at 4 m/s.
    inside = FocusOfExpansion(course=-1.6 * rate / 4.0, slope=0.1)
    assert inside.limited(rate, mounting) == inside
    outside = FocusOfExpansion(course=1.6 * rate / 4.0, slope=0.1).limited(rate, mounting)
    assert 0.0 < turn * outside.course < math.radians(8.0) and outside.slope == 0.1
    far = FocusOfExpansion(course=-turn * math.radians(60.0)).limited(rate, mounting)
    assert math.radians(16.0) < -turn * far.course < math.radians(45.0)
    # Straight on, only the errors of course and mounting are left.
    straight = inside.limited(0.0, mounting)
    assert straight.course == pytest.approx(
        -turn * 2.0 * math.hypot(math.radians(1.0), mounting.deviation))
    # A vehicle that spins does not travel backwards.
    spinning = FocusOfExpansion(course=-turn * 3.0).limited(10.0 * rate, mounting)
    assert math.radians(90.0) <= -turn * spinning.course < math.radians(100.0)


@pytest.mark.parametrize('seconds', [0.01, 0.1, 3.0])
def test_with_nothing_seen_the_direction_of_travel_stays_as_uncertain_as_it_is(seconds):
    usual = FocusOfExpansion()
    mounting = Mounting()
    later = usual.predict(seconds, 0.0, mounting)
    assert later.course_variance == pytest.approx(usual.course_variance)
    assert later.slope_variance == pytest.approx(usual.slope_variance)
    mounting.angle = 0.05
    mounted = FocusOfExpansion(course=0.0, course_variance=1e-9).predict(seconds, 0.0, mounting)
    assert mounted.course == pytest.approx(0.05 * (1.0 - math.exp(-seconds)))


def test_a_camera_that_only_turns_tells_nothing_of_the_direction_of_travel():
    expected = FocusOfExpansion(0.03, -0.02, math.radians(1.0) ** 2, math.radians(0.5) ** 2)
    world = World()
    u, w = world.displacements(yaw=0.02)
    fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
    found = fit(u, w, np.ones_like(u), expected).travel
    assert (found.course, found.slope) == pytest.approx((0.03, -0.02), abs=1e-3)
    assert found.course_variance == pytest.approx(expected.course_variance, rel=0.05)
    assert found.slope_variance == pytest.approx(expected.slope_variance, rel=0.05)


@pytest.mark.parametrize(('half', 'near', 'far'), [(0.7, 5.0, 60.0), (0.15, 5.0, 15.0)])
def test_the_motion_scatters_as_it_says(half, near, far):
    """The narrower the view, the more of a wrong direction of travel becomes yaw."""
    rng, errors = np.random.default_rng(7), []
    course, slope = math.radians(1.0), math.radians(1.0)
    for _ in range(150):
        world = World(seed=int(rng.integers(1 << 30)))
        world.azimuths = rng.uniform(-half, half, 160)
        world.distances = rng.uniform(near, far, 160)
        drawn, climb = rng.normal(0.0, course), rng.normal(0.0, slope)
        u, w = world.displacements(yaw=0.0, step=0.8, course=drawn, climb=climb)
        u, w = (each + rng.normal(0.0, DEVIATION, 160) for each in (u, w))
        fit = MotionFit(world.azimuths, world.slopes, deviation=DEVIATION)
        found = fit(u, w, np.ones_like(u), FocusOfExpansion(0.0, 0.0, course ** 2, slope ** 2))
        errors.append([
            found.yaw ** 2 / found.yaw_variance,
            (found.travel.course - drawn) ** 2 / found.travel.course_variance,
            (found.travel.slope - climb) ** 2 / found.travel.slope_variance])
    assert np.all(np.mean(errors, axis=0) > 0.4)
    assert np.all(np.mean(errors, axis=0) < 1.8)
