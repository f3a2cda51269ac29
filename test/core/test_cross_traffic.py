# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Traffic that crosses close in front of a standing vehicle does not turn the heading."""

import math

from crossing_lorry import crossing, halted
import cv2
import far_scene
import numpy as np
from phase_traj_ros.core import (
    CodeSource,
    EstimatorSettings,
    Lens,
    PairStatus,
    TrajectoryEstimator,
)
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest
import turning_camera

HFOV_DEG = 70.0
KNOWN = Lens(hfov_deg=HFOV_DEG)
TENTH = 100_000_000
HALT = 25
"""The frame at which the vehicle halts, before its turn."""


@pytest.fixture(scope='module')
def drive():
    plan = plan_drive(
        'a corner', [Straight(3.0), Turn(-90.0, 4.0), Straight(1.5)], rate_hz=10.0, speed=6.0,
        seed=8, camera=Camera.with_field_of_view(320, 240, HFOV_DEG))
    return list(render_drive(plan))


def headings(frames, *, lens=KNOWN, source=CodeSource.AUTO):
    """Return the estimator after the frames, and the heading at each of them, in degrees."""
    estimator = TrajectoryEstimator(EstimatorSettings(code_source=source, lens=lens))
    updates = [estimator.update(frame, n * TENTH) for n, frame in enumerate(frames)][1:]
    return estimator, [0.0, *(math.degrees(each.heading.heading) for each in updates)]


@pytest.mark.parametrize(('lens', 'width', 'height', 'step'), [
    (KNOWN, 0.8, 0.7, 6), (None, 0.8, 0.7, -15), (None, 1.5, 0.6, 10), (KNOWN, 1.5, 0.75, -6)])
def test_a_lorry_that_crosses_close_in_front_is_not_a_turn(drive, lens, width, height, step):
    before = drive[:HALT + 1]
    lorry = list(crossing(drive[HALT], width=width, height=height, step=step))
    estimator, heading = headings([*before, *lorry, *halted(drive[HALT], 5)], lens=lens)
    standing = heading[HALT + 5:]
    # It was 1.3 degrees where the last pair of the lorry was taken back.
    assert max(standing) - min(standing) < 0.5
    assert not estimator.turns and not estimator.heading.finish()
    assert estimator.heading.camera.learned is None


def test_the_heading_goes_on_with_the_turn_after_the_lorry(drive):
    lorry = list(crossing(drive[HALT], width=1.2, height=0.7, step=10))
    frames = [*drive[:HALT + 1], *lorry, *drive[HALT + 1:]]
    estimator, heading = headings(frames)
    assert heading[-1] - heading[HALT + len(lorry)] == pytest.approx(-90.0, abs=8.0)
    [turn] = [*estimator.turns, *estimator.heading.finish()]
    assert turn.quarter_turns == -1


@pytest.mark.parametrize('top', [0.1, 0.3])
def test_traffic_at_a_red_light_does_not_block_the_view(drive, top):
    """Slow traffic crosses in a part of the view, above a road that rests."""
    lorry = list(crossing(drive[HALT], width=0.7, height=0.3, top=top, step=6, wait=15))
    estimator = TrajectoryEstimator(EstimatorSettings(code_source=CodeSource.AUTO, lens=KNOWN))
    updates = [estimator.update(frame, n * TENTH)
               for n, frame in enumerate([*drive[:HALT + 1], *lorry])]
    # Where the blocks agree on a motion of the lorry, it takes 0.3 s to see the road rest again.
    stands = [update.status is PairStatus.STILL for update in updates[HALT + 15:]]
    assert stands.count(False) <= 6 < 0.1 * len(stands)
    assert estimator.reliability.reliable


@pytest.mark.parametrize('start', [HALT, HALT + 10])
def test_a_turn_from_a_halt_counts_though_the_dashboard_does_not_move(drive, start):
    frames = [*halted(drive[start], 15), *drive[start:]]
    _, clear = headings(frames)
    noise = np.random.default_rng(4).integers(0, 255, (96, 320)).astype(np.uint8)
    dashboard = cv2.normalize(
        cv2.GaussianBlur(noise, (0, 0), 3), None, 0, 255, cv2.NORM_MINMAX)
    _, heading = headings([np.vstack([frame[:-96], dashboard]) for frame in frames])
    assert clear[-1] < -40.0
    assert heading[-1] == pytest.approx(clear[-1], abs=8.0)


def test_a_robot_may_turn_on_the_spot():
    camera, frames = turning_camera.turning('barrel')
    _, heading = headings(
        [*halted(frames[0], 15), *frames], lens=Lens(camera=camera))
    assert max(heading) == pytest.approx(max(turning_camera.HEADINGS), abs=0.5)
    assert heading[-1] == pytest.approx(turning_camera.HEADINGS[-1], abs=0.5)


@pytest.mark.parametrize('acceleration', [5.0, 50.0])
def test_a_robot_that_sees_much_of_its_body_turns_on_the_spot(acceleration):
    camera = turning_camera.BARREL
    seconds = np.maximum(np.arange(40) / 10.0 - 1.5, 0.0)
    truth = np.minimum(acceleration * seconds ** 2 / 2, 20.0 * seconds)
    truth = np.minimum(truth, 8.0)
    body = np.random.default_rng(4).integers(0, 255, (360, 480)).astype(np.uint8)
    body = cv2.normalize(cv2.GaussianBlur(body, (0, 0), 3), None, 0, 255, cv2.NORM_MINMAX)
    rng, frames = np.random.default_rng(5), []
    for heading in truth:
        frame = far_scene.render(camera, far_scene.barrel, math.radians(heading)).astype(float)
        frame[198:] = body[198:]
        frames.append(np.clip(frame + rng.normal(0.0, 1.5, frame.shape), 0, 255).astype(np.uint8))
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(camera=camera)))
    updates = [estimator.update(frame, n * TENTH) for n, frame in enumerate(frames)][1:]
    turns = np.diff(truth) > 0.2
    assert not any(update.status is PairStatus.STILL for update in np.array(updates)[turns])
    assert updates[10].status is PairStatus.STILL
    assert 6.0 < math.degrees(updates[-1].heading.heading) < 12.0


def test_a_queue_of_lorries_does_not_make_the_street_fixed_to_the_camera(drive):
    lorries = [
        frame for seed in range(2)
        for frame in crossing(drive[HALT], width=2.0, height=0.6, step=8, wait=3, seed=seed)]
    estimator, heading = headings([*drive[:HALT + 1], *lorries])
    assert abs(heading[-1] - heading[HALT + 5]) < 4.0
    assert not estimator.turns
