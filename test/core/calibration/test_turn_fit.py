# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The lens from points that are followed through a turn."""

from dataclasses import replace
import math
from types import SimpleNamespace

import numpy as np
from phase_traj_ros.core.calibration.lens_calibration import LensCalibration
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_fit import fit_turn
from phase_traj_ros.core.calibration.turn_tracks import TurnTracks
from phase_traj_ros.core.camera.lens_family import project
from phase_traj_ros.synthetic.camera import BODY_TO_PICTURE, rotation
import pytest

(WIDTH, HEIGHT) = (320, 240)
GUESSES = [(0.23 * WIDTH, 1.0, 0.0), (0.45 * WIDTH, 0.6, 0.0), (0.9 * WIDTH, 0.9, 0.0)]


def tracks_of(*, focal, straightness=1.0, column=0.0, turned_deg=60.0, pitch_deg=0.0,
              roll_deg=0.0, ahead=0.0, noise=0.1, wrong=0.0, steps=11, yaws_deg=None, step=None,
              seed=0):
    """
    Return what a camera sees of points all round, on an arc of 8 m radius.

    ``yaws_deg`` and ``step``, the metres between two frames, describe another turn. The camera is
    ``ahead`` metres ahead of the rear axle, the point that moves along the arc.
    """
    rng = np.random.default_rng(seed)
    count = 1500
    (around, away) = (rng.uniform(-math.pi, math.pi, count), rng.uniform(8.0, 60.0, count))
    points = np.stack([
        away * np.cos(around), away * np.sin(around), rng.uniform(-1.5, 6.0, count)], axis=1)
    sights = []
    yaws = np.radians(np.linspace(0.0, turned_deg, steps) if yaws_deg is None else yaws_deg)
    between = (yaws[1:] + yaws[:-1]) / 2.0
    step = step or 8.0 * abs(yaws[1] - yaws[0])
    moved = step * np.stack([np.cos(between), np.sin(between), 0.0 * between], axis=1)
    positions = np.concatenate([np.zeros((1, 3)), np.cumsum(moved, axis=0)])
    for (frame, yaw) in enumerate(yaws):
        position = positions[frame] + ahead * np.array([math.cos(yaw), math.sin(yaw), 0.0])
        tilted = rotation(yaw, math.radians(pitch_deg), math.radians(roll_deg))
        seen = (points - position) @ tilted @ BODY_TO_PICTURE.T
        visible = np.flatnonzero(seen[:, 2] > 0.5)
        at = project(seen[visible], focal, straightness) + np.array((column, 0.0))
        inside = (abs(at) < (WIDTH / 2, HEIGHT / 2)).all(axis=1)
        at = at[inside] + noise * rng.standard_normal((inside.sum(), 2))
        strays = rng.random(len(at)) < wrong
        at[strays] += rng.uniform(-30, 30, (strays.sum(), 2))
        sights.append(np.column_stack([visible[inside], np.full(len(at), frame), at]))
    sights = np.concatenate(sights)
    (names, times) = np.unique(sights[:, 0], return_counts=True)
    kept = names[times >= 3][:100]
    sights = sights[np.isin(sights[:, 0], kept)]
    sights = sights[np.lexsort((sights[:, 1], sights[:, 0]))]
    point = np.unique(sights[:, 0], return_inverse=True)[1]
    return TurnTracks(
        point.astype(np.int64), sights[:, 1].astype(np.int64), sights[:, 2:],
        focal * yaws, 0.1 * np.arange(steps))


@pytest.mark.parametrize(('focal', 'straightness'), [
    (75.0, 1.0), (180.0, 1.0), (380.0, 1.0), (130.0, 0.25), (140.0, 0.0), (150.0, -0.3)])
@pytest.mark.parametrize('turned_deg', [60.0, -60.0])
def test_a_turn_tells_focal_length_and_distortion(focal, straightness, turned_deg):
    tracks = tracks_of(focal=focal, straightness=straightness, turned_deg=turned_deg)
    fit = fit_turn(tracks, GUESSES, width=WIDTH)
    assert math.exp(fit.log_focal) == pytest.approx(focal, rel=0.04)
    # Through a narrow lens, distortion is hard to see, and makes no difference.
    assert fit.straightness == pytest.approx(straightness, abs=0.05 if focal < 300 else 0.3)
    assert math.degrees(fit.angle) == pytest.approx(turned_deg, abs=2.5)
    assert fit.cost < 1.0


def test_a_narrow_lens_is_found_from_the_start_values_of_wide_ones():
    # 20 degrees: the view hardly tells its focal length, and the fit says so.
    guesses = [(focal * WIDTH, straightness, column * WIDTH)
               for focal, straightness, column in TUNING.guesses]
    fits = [fit_turn(tracks_of(focal=900.0, turned_deg=10.0, seed=seed), guesses, width=WIDTH)
            for seed in range(4)]
    assert math.exp(np.mean([fit.log_focal for fit in fits])) == pytest.approx(900.0, rel=0.12)
    assert all(0.08 < math.sqrt(fit.covariance[0, 0]) < 0.3 for fit in fits)


@pytest.mark.parametrize('focal', [180.0, 260.0])
def test_a_small_turn_that_any_lens_explains_is_ambiguous(focal):
    guesses = [(share * WIDTH, straightness, column * WIDTH)
               for share, straightness, column in TUNING.guesses]
    for seed in range(4):
        small = tracks_of(focal=focal, turned_deg=5.0, noise=1.0, seed=seed)
        assert fit_turn(small, guesses, width=WIDTH).ambiguous
        large = tracks_of(focal=focal, turned_deg=20.0, noise=0.3, seed=seed)
        assert not fit_turn(large, guesses, width=WIDTH).ambiguous


def test_points_that_go_astray_hardly_count():
    fit = fit_turn(tracks_of(focal=180.0, wrong=0.1), GUESSES, width=WIDTH)
    assert math.exp(fit.log_focal) == pytest.approx(180.0, rel=0.05)


@pytest.mark.parametrize(('moving', 'turns'), [(0.25, 1), (0.45, 0)])
def test_nothing_is_learned_where_few_points_agree(moving, turns, monkeypatch):
    """A wrong lens may explain half of the points, as in a bend of a motorway with traffic."""
    for seed in range(3):
        tracks = tracks_of(focal=260.0, turned_deg=40.0, seed=seed)
        rng = np.random.default_rng(seed)
        velocity = rng.uniform(2.0, 5.0, (100, 2)) * rng.choice([-1.0, 1.0], (100, 2))
        velocity[rng.permutation(100) >= 100 * moving] = 0.0
        tracks = replace(tracks, position=(
            tracks.position + velocity[tracks.point] * tracks.frame[:, None]))
        calibration = LensCalibration()
        monkeypatch.setattr(calibration, '_tracker', SimpleNamespace(
            cut=lambda: None, update=lambda *_, tracks=tracks, **__: tracks))
        calibration.update(np.zeros((HEIGHT, WIDTH), np.uint8), 0.0, 0.1)
        assert calibration.turns == turns
        if turns:
            assert calibration.estimate.focal_px == pytest.approx(260.0, rel=0.1)


def test_the_axis_of_the_turn_is_the_vertical():
    fit = fit_turn(tracks_of(focal=180.0, pitch_deg=12.0, roll_deg=-4.0), GUESSES, width=WIDTH)
    (right, down, ahead) = fit.down
    assert math.degrees(math.asin(ahead)) == pytest.approx(12.0, abs=1.0)
    assert math.degrees(math.atan2(right, down)) == pytest.approx(-4.0, abs=1.0)


def test_neither_a_pitched_camera_nor_one_ahead_of_the_axle_changes_the_focal_length():
    # As on a model car: it moves 24 degrees sideways in the turn, and rolls as it turns.
    fits = [fit_turn(
        tracks_of(focal=150.0, straightness=-0.15, pitch_deg=22.0, ahead=3.5, turned_deg=-75.0,
                  noise=0.3, seed=seed), GUESSES, width=WIDTH) for seed in range(8)]
    assert math.exp(np.mean([fit.log_focal for fit in fits])) == pytest.approx(150.0, rel=0.04)
    assert math.degrees(np.mean([fit.angle for fit in fits])) == pytest.approx(-75.0, abs=3.0)


@pytest.mark.parametrize('slow', [2, 3])
def test_a_vehicle_that_slows_to_a_creep_within_a_turn_tells_the_focal_length(slow):
    # From 8 to 0.4 m/s: the last steps are as long as the others, and last 20 times as long.
    is_slow = np.arange(10) >= 10 - slow
    yaws = np.append(0.0, np.cumsum(np.where(is_slow, 6.9, 2.6)))
    seconds = np.append(0.0, np.cumsum(np.where(is_slow, 6.0, 0.3)))
    for seed in range(8):
        tracks = tracks_of(focal=180.0, yaws_deg=yaws, step=2.4, noise=0.15, seed=seed)
        fit = fit_turn(replace(tracks, seconds=seconds), GUESSES, width=WIDTH)
        assert math.exp(fit.log_focal) == pytest.approx(180.0, rel=0.06)


def test_the_principal_point_is_found():
    fit = fit_turn(tracks_of(focal=180.0, column=14.0), GUESSES, width=WIDTH)
    assert fit.column == pytest.approx(14.0, abs=4.0)


def test_its_deviations_grow_as_the_turn_gets_smaller():
    (small, large) = (
        fit_turn(tracks_of(focal=180.0, turned_deg=turned), GUESSES, width=WIDTH)
        for turned in (15.0, 60.0))
    assert small.covariance[0, 0] > 4 * large.covariance[0, 0]


def test_the_same_tracks_give_the_same_fit():
    (one, other) = (fit_turn(tracks_of(focal=180.0), GUESSES, width=WIDTH) for _ in range(2))
    assert (one.log_focal, one.straightness) == (other.log_focal, other.straightness)
