# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.rotation.camera_pitch import CameraPitch
from phase_traj_ros.core.rotation.tuning import TUNING
import pytest


def driven(tilt, pitches, *, slope_error=0.004, slides=False, seed=1):
    rng = np.random.default_rng(seed)
    for pitch in pitches:
        tilt.predict(0.1)
        tilt.add(pitch + slope_error * rng.normal(), slope_error ** 2)
        if slides:
            # Patches made level; the far one is two heights farther ahead.
            ratio = math.exp(2.0 * 2.0 * (pitch + 0.008 * rng.normal()))
            tilt.add_slides(ratio, 2.0, (4.0 * 0.008) ** 2, assumed=0.0)
    return tilt


@pytest.mark.parametrize('pitch', [-0.05, 0.0, 0.02, 0.1])
def test_it_finds_the_mounting_within_seconds(pitch):
    tilt = driven(CameraPitch(Horizon()), [pitch] * 60)
    assert tilt.mounting == pytest.approx(pitch, abs=0.003)
    assert tilt.deviation < 0.005


def test_near_and_far_road_tell_as_well():
    tilt = CameraPitch(Horizon(pitch_deviation=0.02))
    rng = np.random.default_rng(2)
    for _ in range(200):
        tilt.predict(0.1)
        ratio = math.exp(4.0 * (0.012 - 0.01 + 0.01 * rng.normal()))
        tilt.add_slides(ratio, 2.0, 0.04 ** 2, assumed=0.01)
    assert tilt.mounting == pytest.approx(0.012, abs=0.003)


def test_it_follows_the_springs_and_keeps_the_mounting():
    tilt = driven(CameraPitch(Horizon()), [0.01] * 200, slides=True)
    braking = driven(tilt, [0.02] * 15, slides=True)
    assert braking.current == pytest.approx(0.02, abs=0.005)
    assert braking.mounting == pytest.approx(0.01, abs=0.004)


@pytest.mark.parametrize('given_deg', [0.0, 4.0, -4.0])
def test_a_pitch_that_was_given_wrong_is_mended(given_deg):
    tilt = driven(CameraPitch(Horizon().with_given(pitch_deg=given_deg)), [0.01] * 200)
    assert tilt.mounting == pytest.approx(0.01, abs=0.003)


def test_one_wild_value_hardly_counts():
    tilt = driven(CameraPitch(Horizon()), [0.01] * 100)
    before = tilt.current
    tilt.add(0.5, 0.004 ** 2)
    assert tilt.current == pytest.approx(before, abs=0.006)


def test_a_measured_nod_moves_the_pitch_by_as_much():
    tilt = driven(CameraPitch(Horizon()), [0.01] * 100)
    before, deviation = tilt.current, tilt.deviation
    tilt.nod(0.01, 0.003)
    assert tilt.current == pytest.approx(before - 0.01)
    assert tilt.deviation == pytest.approx(math.hypot(deviation, 0.003))


def test_what_is_not_measured_becomes_uncertain():
    tilt = driven(CameraPitch(Horizon()), [0.01] * 100, slides=True)
    sure = tilt.swing_deviation
    tilt.predict(5.0)
    mounted = tilt.common_deviation
    # The springs forget what they were within seconds, the load of the vehicle takes minutes.
    assert tilt.swing_deviation == pytest.approx(math.radians(0.5), rel=0.01)
    assert tilt.swing_deviation > 1.5 * sure
    tilt.predict(5.0)
    assert tilt.common_deviation < 1.1 * mounted
    tilt.predict(600.0)
    assert math.hypot(mounted, math.radians(0.2)) < tilt.common_deviation
    assert tilt.common_deviation < math.hypot(mounted, math.radians(0.5))


def test_both_parts_make_up_the_error_of_their_sum():
    tilt = driven(CameraPitch(Horizon()), [0.01] * 100, slides=True)
    parts = math.hypot(tilt.swing_deviation, tilt.common_deviation)
    assert parts == pytest.approx(math.hypot(tilt.deviation, TUNING.common_pitch_error))
    # Only the sum is measured: nobody knows which of the two it was.
    assert tilt.deviation < math.radians(0.2)


@pytest.mark.parametrize('interval', [0.02, 0.1])
def test_the_pitch_scatters_as_it_says(interval):
    rng, errors = np.random.default_rng(7), []
    kept = math.exp(-interval / 1.0)
    for _ in range(150):
        mounting, springs = rng.normal(0.0, np.radians((2.0, 0.4)))
        tilt = CameraPitch(Horizon(pitch_deviation=math.radians(2.0)))
        for _ in range(round(4.0 / interval)):
            springs = kept * springs + rng.normal(
                0.0, math.radians(0.4) * math.sqrt(1.0 - kept * kept))
            tilt.predict(interval)
            tilt.add(mounting + springs + 0.004 * rng.normal(), 0.004 ** 2)
        errors.append((tilt.current - mounting - springs) ** 2 / tilt.deviation ** 2)
    assert np.mean(errors) == pytest.approx(1.0, abs=0.35)


def test_a_value_counts_the_less_the_farther_it_is_off():
    """Beyond two standard deviations, twice as far off moves the estimate half as far."""
    def moved(off):
        tilt = driven(CameraPitch(Horizon()), [0.0] * 100)
        before, spread = tilt.current, math.hypot(tilt.deviation, 0.004)
        tilt.add(before + off * spread, 0.004 ** 2)
        return (tilt.current - before) / spread

    assert moved(2.0) == pytest.approx(2.0 * moved(1.0), rel=0.01)
    assert moved(20.0) < moved(10.0) < moved(4.0)
    assert moved(20.0) == pytest.approx(0.5 * moved(10.0), rel=0.1)


@pytest.mark.parametrize('by', ['travel', 'slides'])
def test_a_single_value_makes_the_pitch_as_sure_as_it_says(by):
    rng, errors = np.random.default_rng(9), []
    for _ in range(1500):
        pitch = np.radians((1.0, 0.4)) @ rng.normal(size=2)
        tilt = CameraPitch(Horizon(pitch_deviation=math.radians(1.0)))
        value = pitch + 0.01 * rng.normal()
        if by == 'travel':
            tilt.add(value, 0.01 ** 2)
        else:
            # The far patch is two heights farther ahead, and both were made with another pitch.
            tilt.add_slides(math.exp(4.0 * (value - 0.02)), 2.0, 0.04 ** 2, assumed=0.02)
        errors.append((tilt.current - pitch) ** 2 / tilt.deviation ** 2)
    assert np.mean(errors) == pytest.approx(1.0, abs=0.15)


def test_the_load_of_a_vehicle_changes_the_mounting_by_so_much_and_no_more():
    deviations = []
    for seconds in (0.0, 600.0, 36_000.0):
        tilt = CameraPitch(Horizon(pitch_deviation=0.001))
        tilt.predict(seconds)
        # The springs forget, the mounting does not.
        tilt.predict(5.0)
        deviations.append(tilt.common_deviation)
    assert math.hypot(deviations[0], math.radians(0.2)) < deviations[1] == deviations[2]
