# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Codes from the turns with any camera, and the way between them and the paper's rule."""

from dataclasses import replace
from functools import cache
import math

from far_scene import render
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, Movement, TrajectoryEstimator
from phase_traj_ros.core.camera.in_use import LensOrigin
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest

STEP_NS = 100_000_000
WIDE = CameraModel.pinhole((160, 320), 110.0)
AUTO = EstimatorSettings(code_source=CodeSource.AUTO)
PAPER = replace(AUTO, code_source=CodeSource.SHIFT, threshold=16.0)
YAWS = (0, *[0] * 5, *[-6] * 15, *[0] * 8, *[6] * 15, *[0] * 6)
"""Of each frame, in degrees: a turn to the right, and one to the left."""


@cache
def pictures():
    """Return what a wide camera sees of it, with the noise of its sensor."""
    return [
        sensor_noise(render(WIDE, np.tan, math.radians(heading)), sigma=1.0, seed=index)
        for index, heading in enumerate(np.cumsum(YAWS))]


def feed(estimator, frames, *, start=0):
    updates = [
        estimator.update(frame, (start + index) * STEP_NS) for index, frame in enumerate(frames)]
    return [update for update in updates if update is not None]


def adds_up(estimator):
    movement = list(estimator.codes.movement)
    assert len(movement) == max(0, estimator.frames - 1)
    assert len(estimator.codes.direction) == len(movement) - movement.count(Movement.NO_CHANGE)
    return movement


def changes(estimator):
    return [int(code) for code in adds_up(estimator) if code in (0, 2)]


def told(updates):
    return [update.camera.origin for update in updates if update.camera is not None]


def test_nothing_known_and_the_turns_are_right():
    estimator = TrajectoryEstimator(AUTO)
    updates = feed(estimator, pictures())
    assert changes(estimator) == [2, 0]
    # What it takes the camera for is told with the first pair, and again when it has learned.
    assert told(updates[:1]) == [LensOrigin.ASSUMED]
    assert set(told(updates[1:])) == {LensOrigin.DRIVE}
    assert estimator.heading.camera.in_use.focal_px == pytest.approx(WIDE.fx, rel=0.1)
    assert not estimator.settings.awaits_lens


def test_a_known_camera_is_taken_as_it_is():
    estimator = TrajectoryEstimator(replace(AUTO, lens=Lens(camera=WIDE)))
    updates = feed(estimator, pictures())
    assert changes(estimator) == [2, 0]
    assert told(updates) == [LensOrigin.CALIBRATION]
    assert estimator.heading.camera.learned is None


@pytest.mark.parametrize('late', [5, 25, 35])
def test_a_calibration_that_comes_late_corrects_the_heading_once(late):
    estimator = TrajectoryEstimator(AUTO)
    updates = feed(estimator, pictures()[:late])
    before = updates[-1].heading.heading
    calibrated = Lens(camera=WIDE)
    guessed = estimator.heading.camera.lens
    for _ in range(3):
        estimator.use_lens(calibrated)
    after = feed(estimator, pictures()[late:], start=late)
    # It has not waited, and it is told once.
    assert len(updates) == late - 1
    assert told(after) == [LensOrigin.CALIBRATION]
    factor = guessed.focal_for(320) / WIDE.fx / calibrated.tilt * guessed.tilt
    first = after[0].heading
    assert first.heading - first.yaw == pytest.approx(before * factor, abs=1e-6)
    # A factor is not quite what a wrong focal length does to a large angle. Each pair adds its
    # own yaw, and nothing else, from then on.
    headings = [update.heading.heading for update in after]
    yaws = [update.heading.yaw for update in after]
    assert np.diff(headings) == pytest.approx(yaws[1:])
    assert math.degrees(headings[-1]) == pytest.approx(0.0, abs=6.0 + abs(YAWS[late]))
    assert changes(estimator) == [2, 0]
    assert estimator.heading.camera.learned is None


def test_a_reset_and_a_loop_keep_the_camera_that_was_learned():
    estimator = TrajectoryEstimator(AUTO)
    feed(estimator, pictures())
    learned = estimator.heading.camera.lens
    assert learned.origin is LensOrigin.DRIVE
    estimator.reset()
    assert estimator.heading.camera.lens is learned
    updates = feed(estimator, pictures(), start=1000)
    assert updates[0].camera is None
    estimator.reset()
    again = feed(estimator, pictures()[:6], start=3)
    assert len(again) == 5 and estimator.frames == 6
    assert LensOrigin.ASSUMED not in told([*updates, *again])


@pytest.mark.parametrize('lens', [None, Lens(camera=WIDE)])
def test_a_threshold_switches_to_the_papers_rule_and_back(lens):
    auto, paper = (replace(each, lens=lens) for each in (AUTO, PAPER))
    estimator = TrajectoryEstimator(auto)
    feed(estimator, pictures())
    assert changes(estimator) == [2, 0]
    for settings in (paper, auto, paper):
        estimator.reconfigure(settings)
        # Started anew.
        assert (estimator.frames, list(estimator.codes.movement), estimator.turns) == (0, [], ())
        assert estimator.path.tip is None
        updates = feed(estimator, pictures(), start=1000)
        assert len(adds_up(estimator)) == len(YAWS) - 1
        assert [update.pair for update in updates] == list(range(len(YAWS) - 1))
        if settings is paper:
            # Exactly what it says by itself, shifts and all.
            by_itself = TrajectoryEstimator(PAPER)
            expected = feed(by_itself, pictures(), start=1000)
            assert list(estimator.codes.movement) == list(by_itself.codes.movement)
            assert [update.shift for update in updates] == [update.shift for update in expected]
            assert [update.tip for update in updates] == [update.tip for update in expected]
            assert estimator.settings.threshold_set == 16.0
        else:
            assert estimator.settings.threshold_set is None
            assert changes(estimator) == [2, 0]
        # The heading is measured in both.
        assert all(update.heading is not None for update in updates)


def test_the_same_settings_again_start_nothing_anew():
    estimator = TrajectoryEstimator(AUTO)
    feed(estimator, pictures()[:20])
    estimator.reconfigure(replace(AUTO, threshold=40.0))
    assert estimator.frames == 20
    estimator.reconfigure(replace(PAPER, threshold=40.0))
    feed(estimator, pictures()[:20])
    estimator.reconfigure(replace(PAPER, threshold=12.0))
    assert (estimator.frames, estimator.settings.threshold_set) == (20, 12.0)


def test_what_else_is_settled_stays_refused_with_a_switch():
    estimator = TrajectoryEstimator(AUTO)
    for change in ({'speed': 5.0}, {'connectivity': 8, 'code_source': CodeSource.HEADING}):
        with pytest.raises(ValueError, match='fixed at the start'):
            estimator.reconfigure(replace(PAPER, **change))
    paper = TrajectoryEstimator(PAPER)
    with pytest.raises(ValueError, match='the code source is fixed'):
        paper.reconfigure(AUTO)


def test_a_camera_that_is_upside_down_is_learned_the_right_way_up():
    off = replace(WIDE, cx=WIDE.cx + 40.0)
    frames = [render(off, np.tan, math.radians(heading)) for heading in np.cumsum(YAWS)]
    upright = TrajectoryEstimator(replace(AUTO, lens=Lens(focal_px=WIDE.fx, offset=40 / 320)))
    view = replace(AUTO.view, rotate_180=True)
    turned = TrajectoryEstimator(replace(
        AUTO, view=view, lens=Lens(focal_px=WIDE.fx, offset=40 / 320)))
    expected = feed(upright, frames)
    found = feed(turned, [np.ascontiguousarray(frame[::-1, ::-1]) for frame in frames])
    assert [update.heading.yaw for update in found] == pytest.approx(
        [update.heading.yaw for update in expected], abs=1e-3)
    assert [math.degrees(update.heading.heading) for update in found[-3:]] == pytest.approx(
        [0.0] * 3, abs=2.0)
    assert changes(turned) == changes(upright) == [2, 0]


def test_a_bag_in_a_loop_is_the_evidence_of_one():
    once, looped = TrajectoryEstimator(AUTO), TrajectoryEstimator(AUTO)
    feed(once, pictures())
    for _ in range(3):
        looped.reset()
        feed(looped, pictures())
    assert looped.heading.camera.learned.turns == once.heading.camera.learned.turns
    assert looped.heading.camera.learned.focal_deviation == pytest.approx(
        once.heading.camera.learned.focal_deviation, rel=0.02)
    # What comes after it is evidence again.
    feed(looped, pictures(), start=1000)
    assert looped.heading.camera.learned.turns > once.heading.camera.learned.turns
