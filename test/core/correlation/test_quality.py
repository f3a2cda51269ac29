# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Tests of a measurement, of standing still and of fixed patterns."""

import cv2
from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, Shift
from phase_traj_ros.core.correlation.block_motion import BlockFlow, BlockMotion
from phase_traj_ros.core.correlation.quality import (
    GateSettings,
    PairQuality,
    Quality,
    StillnessDetector,
    StillnessSettings,
)
import pytest
from textures import pair

SHAPE = (240, 320)
WIDTH = 1000
INTERVAL = 0.1
LIMIT = 2e-3 * WIDTH * INTERVAL
FRAMES = 4
MEASURED, STILL, NOTHING = Quality


def verdicts(frames, *, rate_hz=10, **options):
    """Return worth and shift for every pair of frames."""
    options = {
        'gate': GateSettings(),
        'stillness': StillnessSettings(seconds=FRAMES * INTERVAL)} | options
    correlator, quality = PhaseCorrelator(mask=options.get('mask')), PairQuality(**options)
    judged = []
    for frame in frames:
        shift = correlator.update(frame)
        quality.update(frame)
        if shift is not None:
            judged.append(quality.judge(shift, correlator, 1 / rate_hz))
    return judged


def said(frames, **options):
    return [verdict for verdict, _ in verdicts(frames, **options)]


def noisy(frame, sigma, seed):
    noise = np.random.default_rng(seed).normal(0, sigma, frame.shape)
    return np.clip(frame + noise, 0, 255).astype(np.uint8)


def creeping(count, *, zoom=1.004, sigma=0.0):
    """Return the frames of a camera that creeps towards the middle of the image."""
    scene, _ = pair(SHAPE, 0, 0, seed=5)
    frames = []
    for index in range(count):
        grow = cv2.getRotationMatrix2D((160, 120), 0.0, zoom ** (index + 1))
        frame = cv2.warpAffine(scene, grow, SHAPE[::-1], flags=cv2.INTER_CUBIC)
        frames.append(noisy(frame, sigma, index))
    return frames


# --- measured or not

def test_unrelated_frames_are_not_a_measurement():
    frames = [pair(SHAPE, 0, 0, seed=seed)[0] for seed in range(6)]
    assert said(frames) == [NOTHING] * 5


@pytest.mark.parametrize('level', [0, 60, 250])
def test_a_covered_lens_is_not_a_measurement(level):
    frames = [noisy(np.full(SHAPE, level, np.uint8), 4, seed) for seed in range(6)]
    assert said(frames) == [NOTHING] * 5


def test_constant_frames_are_never_a_measurement():
    frames = [np.full(SHAPE, 9, np.uint8)] * 3
    assert said(frames) == said(frames, gate=None) == [NOTHING] * 2
    assert said(frames, gate=GateSettings(min_significance=0.0)) == [NOTHING] * 2


@pytest.mark.parametrize('sigma', [0, 10, 25])
def test_noise_does_not_hide_a_shift(sigma):
    frames = [noisy(frame, sigma, seed) for seed, frame in enumerate(pair(SHAPE, 17.3, -2))]
    (verdict, shift), = verdicts(frames)
    assert verdict is MEASURED
    assert shift.dx == pytest.approx(17.3, abs=0.5)


def test_without_a_gate_everything_is_a_measurement():
    frames = [pair(SHAPE, 0, 0, seed=seed)[0] for seed in range(3)]
    assert said(frames, gate=None, stillness=None) == [MEASURED] * 2


def test_the_limit_is_the_one_that_is_set():
    frames = pair(SHAPE, 9, 0)
    correlator = PhaseCorrelator()
    shift = [correlator.update(frame) for frame in frames][1]
    significance = correlator.significance(shift)
    for limit, expected in ((significance * 0.99, shift), (significance * 1.01, None)):
        gate = GateSettings(min_significance=limit)
        assert gate.judge(shift, correlator, None) == expected


# --- standing still

def test_a_held_frame_is_still_after_as_many_pairs_as_are_averaged():
    frames = [pair(SHAPE, 0, 0)[0]] * 8
    assert said(frames) == [MEASURED] * (FRAMES - 1) + [STILL] * (8 - FRAMES)


@pytest.mark.parametrize(('sigma', 'rate_hz'), [(1, 10), (5, 10), (15, 10), (15, 3), (10, 60)])
def test_noise_does_not_end_standing_still(sigma, rate_hz):
    scene, _ = pair(SHAPE, 0, 0)
    frames = [noisy(scene, sigma, seed) for seed in range(20 + 2 * rate_hz)]
    answers = said(frames, rate_hz=rate_hz)
    assert set(answers[round(FRAMES * INTERVAL * rate_hz):]) == {STILL}


def test_flicker_does_not_end_standing_still():
    scene, _ = pair(SHAPE, 0, 0)
    gains = np.random.default_rng(0).uniform(0.7, 1.3, 20)
    frames = [np.clip(scene * gain, 0, 255).astype(np.uint8) for gain in gains]
    assert set(said(frames)[FRAMES:]) == {STILL}


@pytest.mark.parametrize('rate_hz', [10, 60])
@pytest.mark.parametrize('sigma', [0, 5, 15])
def test_a_creeping_vehicle_is_not_still(sigma, rate_hz):
    frames = creeping(2 * rate_hz, zoom=1.004 ** (10 / rate_hz), sigma=sigma)
    assert set(said(frames, rate_hz=rate_hz)) == {MEASURED}


def test_a_slow_turn_on_the_spot_is_not_shaking():
    frames = [pair(SHAPE, 0.5 * index, 0)[1] for index in range(12)]
    assert set(said(frames)) == {MEASURED}


@pytest.mark.parametrize('wide', [20, 80])
def test_passing_traffic_does_not_end_standing_still(wide):
    scene, passing = pair(SHAPE, 0, 0)[0], pair(SHAPE, 0, 0, seed=9)[0]
    frames = [scene] * 6
    for left in range(0, SHAPE[1] - wide, 15):
        frame = scene.copy()
        frame[60:220, left:left + wide] = passing[60:220, :wide]
        frames.append(frame)
    assert set(said(frames)[FRAMES:]) == {STILL}


def test_driving_off_is_detected_soon():
    held = [pair(SHAPE, 0, 0, seed=5)[0]] * 8
    answers = said([*held, *creeping(8, zoom=1.02)])
    assert answers[6] is STILL
    assert set(answers[9:]) == {MEASURED}


def test_an_unmeasured_pair_does_not_end_standing_still():
    scene, _ = pair(SHAPE, 0, 0)
    stranger, _ = pair(SHAPE, 0, 0, seed=3)
    answers = said([*[scene] * 7, stranger, *[scene] * 4])
    assert answers[FRAMES:] == [STILL] * (6 - FRAMES) + [NOTHING] * 2 + [STILL] * 3


def test_only_lit_blocks_count():
    # Most of the image is black, as at night, and the rest creeps.
    frames = creeping(20)
    for frame in frames:
        frame[:160] = 0
    assert set(said(frames)) == {MEASURED}


def test_it_takes_as_many_pairs_as_are_averaged():
    scene, _ = pair(SHAPE, 0, 0)
    correlator, quality = PhaseCorrelator(), PairQuality(
        gate=GateSettings(), stillness=StillnessSettings(seconds=FRAMES * INTERVAL))
    answers = []
    for _ in range(FRAMES + 2):
        shift = correlator.update(scene)
        quality.update(scene)
        if shift is not None:
            answers.append(quality.judge(shift, correlator, INTERVAL)[0])
    assert answers == [MEASURED] * (FRAMES - 1) + [STILL] * 2


def test_after_an_interruption_the_newest_frame_is_compared_with_the_next():
    scene, _ = pair(SHAPE, 0, 0)
    correlator, quality = PhaseCorrelator(), PairQuality(
        stillness=StillnessSettings(seconds=2 * INTERVAL))
    answers = []
    for index in range(8):
        shift = correlator.update(scene)
        quality.update(scene)
        if index == 4:
            quality.interrupt()
        elif shift is not None:
            answers.append(quality.judge(shift, correlator, INTERVAL)[0])
    assert answers == [MEASURED, STILL, STILL, MEASURED, STILL, STILL]


def test_blocks_without_a_pair_are_not_used(monkeypatch):
    # Values of another type: the correlator continues, the blocks restart.
    monkeypatch.setattr(BlockMotion, 'share_following', None)
    first, second = behind_a_pattern(24.0)
    (verdict, shift), = verdicts([first, second.astype(np.uint16)])
    assert (verdict, shift.dx) == (MEASURED, pytest.approx(0, abs=0.5))
    scene, _ = pair(SHAPE, 0, 0)
    wide = scene.astype(np.uint16)
    assert said([scene] * 6 + [wide] * 2, gate=None)[-3:] == [STILL, MEASURED, STILL]


def flow(*lengths, textured=None):
    """Return a flow with these displacements to the right."""
    vectors = np.zeros((len(lengths), 2))
    vectors[:, 0] = lengths
    return BlockFlow(vectors, np.ones(len(lengths), bool) if textured is None else textured)


def feed_flows(flows, frames=1, interval=INTERVAL):
    detector = StillnessDetector(StillnessSettings(seconds=frames * INTERVAL, max_motion=2e-3))
    return [detector.update(each, interval, WIDTH) for each in flows]


def test_half_of_the_blocks_start_standing_still_and_a_third_keep_it():
    far = 100 * LIMIT
    stand, half, third, few = (
        flow(*[0.0] * still, *[far] * (12 - still)) for still in (12, 7, 5, 3))
    assert feed_flows([third, half]) == [False, True]
    assert feed_flows([stand, third, few, third]) == [True, True, False, False]


def test_blocks_without_texture_do_not_count():
    textured = np.array([True, True, False, False, False])
    moving, still = (100 * LIMIT, 90 * LIMIT), (0.0, 0.0, 0.0)
    assert feed_flows([flow(*moving, *still, textured=textured)]) == [False]
    assert feed_flows([flow(*moving, *still, textured=~textured)]) == [True]
    assert feed_flows([flow(0.0, 0.0, textured=np.zeros(2, bool))]) == [False]


def test_motion_adds_up_and_shaking_does_not():
    slow = flow(*[-1.2 * LIMIT, 1.2 * LIMIT] * 4)
    there, back = flow(*[-9 * LIMIT, 9 * LIMIT] * 4), flow(*[9 * LIMIT, -9 * LIMIT] * 4)
    assert not any(feed_flows([slow] * 6, frames=4))
    assert feed_flows([there, back] * 3, frames=4) == [False] * 3 + [True] * 3


@pytest.mark.parametrize('rate_hz', [2, 4, 10, 30, 120])
def test_the_limit_is_a_speed_at_any_frame_rate(rate_hz):
    for speed, stands in ((0.8, True), (1.2, False)):
        moved = speed * LIMIT / INTERVAL / rate_hz
        # Half a second, rounded to whole pairs.
        lasts = max(round(0.5 * rate_hz), 1)
        answers = feed_flows(
            [flow(*[-moved, moved] * 4)] * 3 * lasts, frames=5, interval=1.0 / rate_hz)
        assert answers == [False] * (lasts - 1) + [stands] * (2 * lasts + 1)


def test_a_long_pair_stops_no_vehicle():
    moved = flow(*[-1.2 * LIMIT, 1.2 * LIMIT] * 4)
    far = flow(*[-40 * LIMIT, 40 * LIMIT] * 4)
    detector = StillnessDetector()
    answers = [
        detector.update(each, interval, WIDTH) for each, interval in (
            *[(moved, INTERVAL)] * 6, (far, 30.0), *[(moved, INTERVAL)] * 6)]
    assert not any(answers)
    assert feed_flows([flow(0.0, 0.0)] * 3, interval=30.0) == [True] * 3


def test_the_whole_picture_may_shake_but_not_go_anywhere():
    assert feed_flows([flow(*[1.5 * LIMIT] * 8)]) == [True]
    assert feed_flows([flow(*[4 * LIMIT] * 8)]) == [False]


def test_another_number_of_blocks_restarts_the_detector():
    assert feed_flows([flow(0.0, 0.0)] * 2 + [flow(0.0)] * 2, frames=2) == [
        False, True, False, True]


@given(st.lists(st.lists(
    st.floats(-50, 50), min_size=6, max_size=6), min_size=1, max_size=12), st.integers(1, 5))
def test_mirrored_motion_gives_the_same_result(rows, frames):
    rows = [[round(value, 3) for value in row] for row in rows]
    mirrored = [flow(*(-value for value in row)) for row in rows]
    assert feed_flows([flow(*row) for row in rows], frames) == feed_flows(mirrored, frames)


# --- a fixed pattern

def behind_a_pattern(dx, *, count=2, share=0.3, seed=0):
    """Return frames of a scene that moves by dx each, behind sharp fixed spots."""
    rng = np.random.default_rng(seed)
    spots = cv2.resize((rng.random((24, 32)) < share).astype(np.uint8), SHAPE[::-1],
                       interpolation=cv2.INTER_NEAREST) > 0
    pattern = rng.integers(0, 256, SHAPE, dtype=np.uint8)
    return [np.where(spots, pattern, pair(SHAPE, dx * index, 0)[1]) for index in range(count)]


def test_the_guard_looks_past_a_fixed_pattern():
    frames = behind_a_pattern(24.0)
    (_, locked), = verdicts(frames, gate=GateSettings(look_past_zero=False))
    (verdict, shift), = verdicts(frames)
    assert locked.dx == pytest.approx(0, abs=0.5)
    assert verdict is MEASURED
    assert shift.dx == pytest.approx(24.0, abs=0.5)


class Told:
    """Replaces a correlator and blocks, and returns given values."""

    def __init__(self, *, first, second, share):
        self.significances = {ZERO: first, ELSEWHERE: second}
        self.share = share

    def second_peak(self, *, apart):
        assert apart > 0
        return ELSEWHERE

    def significance(self, shift):
        return self.significances[shift]

    def share_following(self, shift):
        assert shift is ELSEWHERE
        return self.share


ZERO, ELSEWHERE = Shift(0.2, -0.3, 0.3), Shift(25.0, 1.0, 0.1)


@pytest.mark.parametrize(('first', 'second', 'share', 'believed'), [
    (9, 12, 0.6, ELSEWHERE),
    (9, 12, 0.5, ZERO),  # only half of the picture follows it
    (12, 9, 0.9, ZERO),  # the first stands out more
    (2, 5, 0.9, None),   # neither stands out
    (2, 9, 0.9, ELSEWHERE),
    (2, 9, 0.1, None),
])
def test_conditions_for_looking_past_zero(first, second, share, believed):
    told = Told(first=first, second=second, share=share)
    gate = GateSettings(min_significance=6.0)
    assert gate.judge(ZERO, told, told) is believed


def test_only_a_peak_at_zero_is_looked_past():
    told = Told(first=9, second=50, share=1.0)
    for place in (Shift(2.0, 0.0, 0.3), Shift(0.0, -2.0, 0.3)):
        told.significances[place] = 9
        assert GateSettings().judge(place, told, told) is place


def test_a_zero_behind_a_fixed_pattern_stays_zero():
    (_, shift), = verdicts(behind_a_pattern(0.0))
    assert shift.dx == pytest.approx(0, abs=0.1)


def test_the_guard_does_not_follow_traffic():
    scene, passing = pair(SHAPE, 0, 0)[0], pair(SHAPE, 0, 0, seed=9)[0]
    frames = []
    for left in (60, 90):
        frame = scene.copy()
        frame[60:220, left:left + 90] = passing[60:220, :90]
        frames.append(frame)
    correlator = PhaseCorrelator()
    for frame in frames:
        correlator.update(frame)
    second = correlator.second_peak(apart=8)
    # It stands out of noise, and would be taken for a measurement.
    assert second.dx == pytest.approx(30, abs=0.5)
    assert correlator.significance(second) > 6
    (_, shift), = verdicts(frames)
    assert shift.dx == pytest.approx(0, abs=0.1)


def test_the_guard_needs_no_stillness_and_stillness_no_gate():
    (verdict, shift), = verdicts(behind_a_pattern(24.0), stillness=None)
    assert (verdict, shift.dx) == (MEASURED, pytest.approx(24.0, abs=0.5))
    assert said([pair(SHAPE, 0, 0)[0]] * 6, gate=None)[-1] is STILL


def test_with_a_mask_over_it_there_is_nothing_to_look_past():
    frames = behind_a_pattern(24.0)
    mask = np.where(frames[0] == frames[1], 0, 255).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    (_, shift), = verdicts(frames, mask=mask, gate=GateSettings(look_past_zero=False))
    assert shift.dx == pytest.approx(24.0, abs=0.5)


@pytest.mark.parametrize('make', [
    lambda: GateSettings(min_significance=-1.0),
    lambda: GateSettings(min_significance=float('nan')),
    lambda: GateSettings(min_significance=float('inf')),
    lambda: StillnessSettings(seconds=0.0),
    lambda: StillnessSettings(seconds=float('nan')),
    lambda: StillnessSettings(max_motion=0.0),
    lambda: StillnessSettings(max_motion=float('inf')),
])
def test_settings_are_checked(make):
    with pytest.raises(ValueError, match='give'):
        make()


def test_no_shift_is_more_than_the_correlator_says():
    correlator = PhaseCorrelator()
    for frame in pair(SHAPE, 5, 0):
        shift = correlator.update(frame)
    assert GateSettings().judge(shift, correlator, None) is shift
    assert GateSettings().judge(Shift(-90, 50, 0.0), correlator, None) is None
