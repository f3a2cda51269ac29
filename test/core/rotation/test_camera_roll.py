# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The roll of the camera, from its changes and from turns."""

from itertools import pairwise
import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.camera_roll import CameraRoll
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.tuning import TUNING
import pytest

#: Yaw rate in radians per second.
RATE = 0.5


def driven(rolls, rate_hz, *, estimate=None, yaw_rate=RATE, pitch_deg=0.0, rng=None):
    """Return the estimate after a bend with these rolls of the camera, in radians."""
    estimate = estimate or CameraRoll(Horizon())
    interval, slope = 1.0 / rate_hz, -math.tan(math.radians(pitch_deg))
    for before, roll in pairwise(rolls.tolist()):
        # The rates of a camera that turns about the vertical axis, and rolls, and nods.
        yaw = yaw_rate * interval * math.cos(roll)
        nod = 0.0 if rng is None else rng.normal(0.0, TUNING.pitch_walk * math.sqrt(interval))
        estimate.predict(interval, yaw_rate)
        estimate.add(CameraMotion(
            yaw, -yaw * math.tan(roll) + nod, roll - before + yaw * slope, FocusOfExpansion(),
            100.0, 0.9, 1e-8, 0.1), interval, slope)
    return estimate


@pytest.mark.parametrize('rate_hz', [5, 60])
@pytest.mark.parametrize('yaw_rate', [RATE, -RATE])
def test_a_bend_tells_the_roll_of_the_mounting_at_any_rate(rate_hz, yaw_rate):
    roll = math.radians(5.0)
    estimate = driven(np.full(20 * rate_hz, roll), rate_hz, yaw_rate=yaw_rate)
    assert estimate.current == pytest.approx(roll, abs=math.radians(0.7))
    # Half of it may be the lean in the bend, by their priors; a straight tells.
    estimate = driven(np.full(60 * rate_hz, roll), rate_hz, estimate=estimate, yaw_rate=0.0)
    assert abs(estimate.lean) < math.radians(0.1)
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


@pytest.mark.parametrize('pitch_deg', [0.0, 10.0, -10.0])
@pytest.mark.parametrize('side', [1, -1])
def test_a_bicycle_leans_in_a_turn_and_is_upright_again(pitch_deg, side):
    time = np.arange(0.0, 8.0, 0.1)
    lean = side * math.radians(18.0) * np.interp(time, (1, 2, 5, 6), (0.0, 1.0, 1.0, 0.0))
    middle = driven(lean[:35], 10, yaw_rate=-side * RATE, pitch_deg=pitch_deg)
    assert middle.current == pytest.approx(lean[35], rel=0.05)
    rest = driven(lean[34:], 10, estimate=middle, yaw_rate=-side * RATE, pitch_deg=pitch_deg)
    assert abs(rest.current) < math.radians(1.5)


def test_a_lean_without_a_turn_fades():
    time = np.arange(0.0, 60.0, 0.1)
    banked = np.radians(3.0) * np.minimum(time, 1.0)
    estimate = driven(banked, 10, yaw_rate=0.0)
    assert abs(estimate.current) < math.radians(0.1)


def test_only_the_lean_is_forgotten():
    estimate = driven(np.full(100, math.radians(5.0)), 10)
    mounting = estimate.mounting
    assert mounting > math.radians(2.0) and estimate.lean > math.radians(0.5)
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
