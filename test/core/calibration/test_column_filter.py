# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The column of the principal point is learned from turns if the focal length is given."""

from dataclasses import replace
from functools import cache
import math

import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator, View
from phase_traj_ros.core.calibration.column_calibration import ColumnFilter
from phase_traj_ros.core.calibration.turn_fit import TurnFit
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

WIDTH, FOCAL = 640, 350.0
# The focal length, the straightness and the column of a fit err together.
COVARIANCE = np.array([
    [1e-3, 2e-3, 0.15], [2e-3, 6e-3, 0.35], [0.15, 0.35, 40.0]])


def fit(column, *, focal_px=FOCAL, straightness=1.0, cost=1.0):
    return TurnFit(
        math.log(focal_px), straightness, column, COVARIANCE, cost, np.array([0.0, 1.0, 0.0]), 1.5,
        np.ones(10))


def test_errors_of_a_fit_are_removed_by_what_is_given():
    rng = np.random.default_rng(0)
    learned = []
    for _ in range(200):
        found, true = ColumnFilter(FOCAL, 1.0, WIDTH), rng.normal(0.0, 0.015 * WIDTH)
        for _ in range(3):
            # The errors of the fits are 2.5 times those of the points.
            off = rng.multivariate_normal(np.zeros(3), 2.5 ** 2 * COVARIANCE)
            off[2] += rng.normal(0.0, 0.003 * WIDTH)
            found.add(fit(true + off[2], focal_px=FOCAL * math.exp(off[0]),
                          straightness=1.0 + off[1]))
        learned.append((found.column - true, found.deviation))
    errors, deviations = np.array(learned).T
    # The fits alone err by 16 pixels.
    assert np.std(errors) < 6.0
    assert 0.7 < np.std(errors) / np.mean(deviations) < 1.2


def test_a_fit_that_contradicts_what_is_given_counts_little():
    found = ColumnFilter(FOCAL, 1.0, WIDTH)
    found.add(fit(60.0, focal_px=2.0 * FOCAL, straightness=0.2))
    agreeing = ColumnFilter(FOCAL, 1.0, WIDTH)
    agreeing.add(fit(15.0))
    assert abs(found.column) < 3.0 and agreeing.column > 3.0
    assert agreeing.deviation < 0.8 * found.deviation


def test_half_of_the_fits_have_to_contradict_a_focal_length():
    """In gentle bends, the fits err to one side, more than their covariance shows."""
    found = ColumnFilter(FOCAL, 1.0, WIDTH)
    for focal_px, contradicted in (
            (0.8 * FOCAL, True), (0.95 * FOCAL, False), (0.6 * FOCAL, True), (FOCAL, False)):
        found.add(fit(0.0, focal_px=focal_px))
        assert found.contradicted is contradicted


def test_gentle_bends_do_not_contradict_a_focal_length():
    found = ColumnFilter(FOCAL, 1.0, WIDTH)
    found.add(fit(0.0, focal_px=0.6 * FOCAL), judges=False)
    assert not found.contradicted
    found.add(fit(0.0, focal_px=0.8 * FOCAL))
    assert found.contradicted


@pytest.mark.parametrize(('straightness', 'contradicted'), [
    (1.1, False), (0.9, False), (0.3, True), (-0.15, True)])
def test_turns_contradict_a_fisheye_that_is_given_as_a_pinhole(straightness, contradicted):
    """The focal length in the middle of the image is right."""
    found = ColumnFilter(FOCAL, 1.0, WIDTH)
    found.add(fit(0.0, straightness=straightness))
    assert found.contradicted is contradicted


def test_a_narrow_image_hardly_shows_the_straightness():
    found = ColumnFilter(1000.0, 1.0, WIDTH)
    found.add(replace(fit(0.0, focal_px=1000.0, straightness=0.3), covariance=COVARIANCE / 1e3))
    assert not found.contradicted


def test_a_worse_fit_counts_less():
    good, bad = (ColumnFilter(FOCAL, 1.0, WIDTH) for _ in range(2))
    good.add(fit(10.0))
    bad.add(fit(10.0, cost=2.5))
    assert 0.0 < bad.column < good.column < 10.0


CAMERA = Camera.with_field_of_view(480, 240, 80)
AFTER_ONE = 51
"""Number of frames up to the end of the first corner, and a second more."""


@cache
def corners():
    """Return a drive around two corners, and its scene."""
    drive = plan_drive(
        'corners', [Straight(1.0), Turn(90, 3, 4.5), Straight(1.0), Turn(-90, 3, 4.5),
                    Straight(1.0)], rate_hz=10.0, speed=7.0, camera=CAMERA, seed=4)
    return drive, drive.build_scene()


@cache
def drive_of(aside):
    """Return the drive, and its frames; the centre of the lens is aside."""
    drive, scene = corners()
    camera = replace(CAMERA, cx=CAMERA.cx + aside * CAMERA.width)
    return drive, list(render_drive(replace(drive, camera=camera), scene=scene))


def followed(aside, *, factor=1.0, count=None, **offset):
    drive, frames = drive_of(aside)
    frames = frames[:count]
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(focal_px=factor * CAMERA.focal, **offset)))
    updates = [estimator.update(frame, stamp)
               for frame, stamp in zip(frames, drive.stamps_ns.tolist())][1:]
    truth = drive.poses[1:len(frames), 2] - drive.poses[0, 2]
    return estimator, np.degrees([update.heading.heading for update in updates] - truth)


@pytest.mark.parametrize('aside', [-0.025, 0.025])
def test_corners_tell_the_column_of_a_given_focal_length(aside):
    estimator, errors = followed(aside)
    in_use = estimator.heading.camera.in_use
    assert in_use.offset == pytest.approx(aside, abs=0.008)
    assert (in_use.focal_px, in_use.interval_px) == (CAMERA.focal, None)
    assert abs(errors[-1]) < 1.0
    # What was given is not replaced by an estimate, so there is none to write down.
    assert estimator.heading.camera.learned is None


@pytest.mark.parametrize(('aside', 'factor', 'contradicted'), [
    (0.025, 1.0, False), (0.0, 1.04, False), (0.0, 0.96, False),
    (0.0, 1.3, True), (0.0, 0.77, True), (0.0, 0.5, True)])
def test_turns_contradict_a_focal_length_that_is_wrong(aside, factor, contradicted):
    estimator, _ = followed(aside, factor=factor)
    assert ('camera_contradicted' in estimator.reliability.words) is contradicted
    assert estimator.reliability.reliable is not contradicted
    assert estimator.heading.camera.in_use.focal_px == factor * CAMERA.focal
    # Another lens is not judged by the turns before it.
    estimator.use_lens(Lens(focal_px=0.9 * CAMERA.focal))
    assert not estimator.heading.camera.contradicted


def test_a_turn_at_the_end_contradicts_a_focal_length_too():
    drive, frames = drive_of(0.0)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(focal_px=1.5 * CAMERA.focal)))
    for frame, stamp in zip(frames[:27], drive.stamps_ns.tolist()):
        estimator.update(frame, stamp)
    assert not estimator.heading.camera.contradicted
    estimator.heading.finish()
    assert estimator.heading.camera.contradicted


def test_a_column_that_was_learned_upside_down_is_that_of_the_same_pixels():
    estimator, _ = followed(0.025, count=AFTER_ONE)
    learned = estimator.heading.camera.lens.offset
    assert learned > 0.0
    estimator.reconfigure(replace(estimator.settings, view=View(rotate_180=True)))
    assert estimator.heading.camera.lens.offset == -learned
    estimator.reconfigure(replace(estimator.settings, view=View()))
    assert estimator.heading.camera.lens.offset == learned


def test_an_offset_that_is_given_is_believed():
    estimator, _ = followed(0.0, offset=0.01, count=AFTER_ONE)
    assert estimator.heading.camera.in_use.offset == 0.01


def test_the_lens_that_was_given_may_be_given_again():
    estimator, _ = followed(0.025, count=AFTER_ONE)
    learned = estimator.heading.camera.lens
    estimator.use_lens(Lens(focal_px=CAMERA.focal))
    assert estimator.heading.camera.lens is learned
    estimator.use_lens(Lens(focal_px=1.1 * CAMERA.focal))
    assert estimator.heading.camera.lens.offset == 0.0
