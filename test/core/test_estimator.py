# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain for one camera."""

from dataclasses import replace

import cv2
import numpy as np
from phase_traj_ros.core import (
    CodeSource,
    Direction,
    EstimatorSettings,
    GateSettings,
    Lens,
    Movement,
    PairStatus,
    PathSource,
    StillnessSettings,
    TrajectoryEstimator,
    View,
)
from phase_traj_ros.core.codes.threshold_hint import Misfit
from phase_traj_ros.errors import FrameError
import pytest
from textures import pair

STEP_NS = 100_000_000
FRAME, TURNED = pair((64, 120), 30, 0)


NOISE = np.random.default_rng(0)


def show(estimator, frame, stamp_ns, **kwargs):
    """Give an estimator a frame with the noise of a sensor, without which it is repeated."""
    depths = {np.dtype(np.uint8): cv2.CV_8U, np.dtype(np.uint16): cv2.CV_16U}
    if frame.ndim == 2 and frame.dtype in depths and np.ptp(frame) > 0:
        frame = cv2.add(frame, NOISE.normal(size=frame.shape), dtype=depths[frame.dtype])
    return estimator.update(frame, stamp_ns, **kwargs)


def feed(estimator, frames, *, start_ns=0):
    return [
        show(estimator, frame, start_ns + index * STEP_NS) for index, frame in enumerate(frames)]


def test_one_pair_after_another():
    estimator = TrajectoryEstimator()
    updates = feed(estimator, [FRAME, FRAME, TURNED, TURNED])
    assert updates[0] is None
    assert [update.pair for update in updates[1:]] == [0, 1, 2]
    assert [update.stamp_ns for update in updates[1:]] == [STEP_NS, 2 * STEP_NS, 3 * STEP_NS]
    assert [update.step.movement for update in updates[1:]] == [
        Movement.FORWARD, Movement.LEFT, Movement.FORWARD]
    assert updates[2].shift.dx == pytest.approx(30, abs=0.1)
    assert (updates[3].tip.x, updates[3].tip.y) == (1, 2)
    assert estimator.frames == 4
    assert len(estimator.codes.movement) == 3


def test_the_rest_of_a_turn_is_turning():
    roll = [np.roll(FRAME, 30 * index, axis=1) for index in range(4)]
    updates = feed(TrajectoryEstimator(), [FRAME, *roll])
    assert [update.status for update in updates[1:]] == [
        PairStatus.OK, PairStatus.OK, PairStatus.TURNING, PairStatus.TURNING]


@pytest.mark.parametrize('stamp_ns', [STEP_NS, STEP_NS - 1, 0, -10**18])
def test_stamps_have_to_increase(stamp_ns):
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME])
    with pytest.raises(FrameError, match=r'is not after that of the previous .* FrameStream.*res'):
        show(estimator, TURNED, stamp_ns)
    assert (estimator.frames, estimator.last_stamp_ns) == (2, STEP_NS)
    # The refused one is not compared with either.
    assert show(estimator, FRAME, 2 * STEP_NS).shift.response == pytest.approx(1, abs=0.05)
    estimator.reset()
    assert show(estimator, TURNED, stamp_ns) is None


def test_reset_starts_anew():
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME, TURNED])
    estimator.reset()
    assert (estimator.frames, estimator.last_stamp_ns, estimator.path.tip) == (0, None, None)
    assert show(estimator, FRAME, 0) is None
    update = show(estimator, TURNED, STEP_NS)
    assert (update.pair, update.step.direction) == (0, Direction.FORWARD)


def test_a_reset_forgets_the_rate_of_the_stamps():
    used, fresh = TrajectoryEstimator(), TrajectoryEstimator()
    for number in range(20):
        show(used, FRAME, number * STEP_NS // 6)
    used.reset()
    for estimator in (used, fresh):
        show(estimator, FRAME, 0)
    assert used._interval_deviation(STEP_NS) == fresh._interval_deviation(STEP_NS)


def test_another_size_keeps_the_direction_and_ends_the_turn():
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME, TURNED])
    wide, wide_turned = pair((64, 160), 30, 0)
    update = show(estimator, wide, 3 * STEP_NS)
    assert (update.shift, update.status) == (None, PairStatus.REPRIMED)
    assert (update.step.movement, update.step.direction) == (Movement.NO_CHANGE, Direction.LEFT)
    update = show(estimator, wide_turned, 4 * STEP_NS)
    assert (update.step.movement, update.step.direction) == (Movement.LEFT, Direction.BACKWARD)
    assert estimator.counters.reprimed == 1


def test_nothing_to_correlate_is_never_forward():
    black = np.zeros_like(FRAME)
    estimator = TrajectoryEstimator()
    updates = feed(estimator, [FRAME, FRAME, black, black, FRAME, FRAME])
    assert [update.status for update in updates[1:]] == [
        PairStatus.OK, *[PairStatus.NO_MEASUREMENT] * 3, PairStatus.OK]
    assert [update.step.movement for update in updates[1:]] == [1, 3, 3, 3, 1]
    assert estimator.counters.unmeasured == 3


def test_a_bad_frame_is_as_if_it_had_never_come():
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME])
    with pytest.raises(FrameError):
        show(estimator, np.zeros((4, 4), np.uint8), 2 * STEP_NS)
    assert (estimator.frames, estimator.last_stamp_ns) == (2, STEP_NS)
    assert show(estimator, TURNED, 2 * STEP_NS).step.movement is Movement.LEFT


def test_a_bad_frame_from_the_past_resets_nothing():
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME], start_ns=5 * STEP_NS)
    with pytest.raises(FrameError):
        show(estimator, np.zeros((4, 4), np.uint8), 0)
    assert estimator.frames == 2


def test_settings_reach_the_parts():
    estimator = TrajectoryEstimator(
        EstimatorSettings(threshold=50.0, max_runs=2, max_corners=2))
    rolls = [np.roll(FRAME, 30 * (index % 2), axis=1) for index in range(8)]
    assert {update.step.movement for update in feed(estimator, rolls)[1:]} == {Movement.FORWARD}
    estimator.reconfigure(replace(estimator.settings, threshold=20.0))
    updates = feed(estimator, rolls, start_ns=9 * STEP_NS)
    assert {update.step.movement for update in updates[1:]} == {Movement.LEFT, Movement.RIGHT}
    assert len(estimator.codes.movement.runs) == 2
    assert len(estimator.path.corners) == 2


def test_the_threshold_is_checked():
    with pytest.raises(ValueError, match='threshold'):
        TrajectoryEstimator(EstimatorSettings(threshold=-1.0))


@pytest.mark.parametrize('values', [
    {'code_source': CodeSource.HEADING}, {'path_from': PathSource.HEADING}, {'speed': 1.0},
    {'awaits_speeds': True}])
def test_what_needs_a_lens_awaits_it_where_none_is_given(values):
    settings = EstimatorSettings(**values)
    assert settings.needs_lens and settings.awaits_lens and settings.measures_heading
    assert not replace(settings, lens=Lens(hfov_deg=80.0)).awaits_lens
    with pytest.raises(FrameError, match='the camera is unknown'):
        TrajectoryEstimator(settings).update(FRAME, 0)


def test_the_papers_settings_need_no_lens():
    settings = EstimatorSettings()
    assert not (settings.needs_lens or settings.awaits_lens or settings.measures_heading)


@pytest.mark.parametrize('change', [
    {'code_source': CodeSource.HEADING}, {'path_from': PathSource.HEADING},
    {'code_source': CodeSource.HEADING, 'connectivity': 8}, {'lens': Lens(hfov_deg=80.0)},
    {'speed': 1.0}, {'max_speeds': 5}])
def test_what_is_settled_at_the_start_cannot_change(change):
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME, TURNED])
    with pytest.raises(ValueError, match='fixed at the start'):
        estimator.reconfigure(replace(estimator.settings, threshold=50.0, **change))
    assert estimator.settings == EstimatorSettings()
    assert len(estimator.codes.movement) == 2


@pytest.mark.parametrize('name', ['confirm_frames', 'release_frames', 'max_runs'])
def test_settings_refuse_what_the_codes_refuse(name):
    with pytest.raises(ValueError, match=name):
        EstimatorSettings(**{name: 0})


def test_a_calibration_may_come_after_the_change_to_the_papers_rule():
    settings = EstimatorSettings(code_source=CodeSource.AUTO)
    estimator = TrajectoryEstimator(settings)
    feed(estimator, [FRAME, FRAME])
    estimator.reconfigure(replace(settings, code_source=CodeSource.SHIFT))
    lens = Lens(hfov_deg=80.0)
    estimator.use_lens(lens)
    assert estimator.heading.camera.lens == lens


def test_a_reset_starts_the_test_of_stillness_anew():
    estimator = TrajectoryEstimator(EstimatorSettings(stillness=StillnessSettings(seconds=0.3)))
    first = feed(estimator, [FRAME] * 6)
    estimator.reset()
    second = feed(estimator, [FRAME] * 6)
    statuses = [[each.status for each in updates[1:]] for updates in (first, second)]
    assert statuses[0] == [PairStatus.OK] * 2 + [PairStatus.STILL] * 3
    assert statuses[1] == statuses[0]


@pytest.mark.parametrize('lead_in', [0, 1])
def test_the_first_pair_and_the_one_after_a_gap_look_past_zero(lead_in):
    # The peak of a pattern that is fixed to the camera is the highest, but not significant.
    rng = np.random.default_rng(0)
    street = cv2.GaussianBlur(rng.uniform(0, 255, (120, 260)).astype(np.float32), (0, 0), 1.5)
    fixed = np.zeros((120, 240), np.float32)
    fixed[::24, ::24] = 100.0
    frames = [np.ascontiguousarray(street[:, 20 - dx:260 - dx] + fixed) for dx in (0, 12)]
    estimator = TrajectoryEstimator(EstimatorSettings(
        max_gap=0.5, gate=GateSettings(min_significance=6.0, look_past_zero=True)))
    feed(estimator, [frames[0] + np.float32(1.0)][:lead_in])
    update = feed(estimator, frames, start_ns=10**10)[-1]
    assert update.status is PairStatus.OK
    assert update.shift.dx == pytest.approx(0.0, abs=0.1)
    assert estimator.counters.gaps == lead_in


def test_a_frame_refused_for_its_view_leaves_the_heading_as_it_was():
    # Not a number at the lower edge, which the cylinder does not reach.
    rng = np.random.default_rng(1)
    wide = cv2.GaussianBlur(rng.uniform(0, 255, (400, 560)).astype(np.float32), (0, 0), 2.0)
    frames = [np.ascontiguousarray(wide[:, 40 - 4 * k:520 - 4 * k]) for k in range(4)]
    broken = frames[3].copy()
    broken[-1, :] = np.nan
    settings = EstimatorSettings(lens=Lens(hfov_deg=100.0))
    headings = []
    for with_broken in (False, True):
        estimator = TrajectoryEstimator(settings)
        feed(estimator, frames[:2])
        if with_broken:
            with pytest.raises(FrameError, match='NaN'):
                show(estimator, broken, 2 * STEP_NS - 1)
        update = show(estimator, frames[2], 2 * STEP_NS)
        headings.append(update.heading.heading)
    assert headings[0] == headings[1] != 0.0


@pytest.mark.parametrize('scale', [1 / 255, 1, 30])
def test_a_mask_counts_by_its_ratios_for_the_heading_too(scale):
    rng = np.random.default_rng(2)
    wide = cv2.GaussianBlur(rng.uniform(0, 255, (200, 360)).astype(np.float32), (0, 0), 2.0)
    frames = [np.ascontiguousarray(wide[:, 20 - 4 * k:340 - 4 * k]) for k in range(3)]
    mask = np.full((200, 320), 255.0 * scale).astype(np.uint16)
    mask[160:] = 0
    estimator = TrajectoryEstimator(EstimatorSettings(lens=Lens(hfov_deg=80.0)), mask=mask)
    updates = feed(estimator, frames)
    reference = TrajectoryEstimator(
        EstimatorSettings(lens=Lens(hfov_deg=80.0)), mask=np.where(mask, 255, 0).astype(np.uint8))
    expected = feed(reference, frames)
    assert [each.heading for each in updates[1:]] == [each.heading for each in expected[1:]]


def test_a_mask_may_not_vanish_when_frames_are_reduced():
    mask = np.zeros((101, 101), np.uint8)
    mask[100, 100] = 255
    TrajectoryEstimator(EstimatorSettings(), mask=mask)
    with pytest.raises(ValueError, match=r'mask is empty .* with a decimation of 2'):
        TrajectoryEstimator(EstimatorSettings(view=View(decimation=2)), mask=mask)


def test_a_gap_keeps_the_direction_and_ends_the_turn():
    estimator = TrajectoryEstimator(EstimatorSettings(max_gap=0.5))
    feed(estimator, [FRAME, FRAME, TURNED])
    update = show(estimator, FRAME, 20 * STEP_NS)
    assert (update.shift, update.status) == (None, PairStatus.GAP)
    assert (update.step.movement, update.step.direction) == (Movement.NO_CHANGE, Direction.LEFT)
    update = show(estimator, TURNED, 21 * STEP_NS)
    assert (update.status, update.step.movement) == (PairStatus.OK, Movement.LEFT)
    assert estimator.counters.gaps == 1


def test_the_longest_interval_allowed_is_no_gap():
    estimator = TrajectoryEstimator(EstimatorSettings(max_gap=0.1))
    updates = feed(estimator, [FRAME, FRAME, FRAME])
    assert [update.status for update in updates[1:]] == [PairStatus.OK] * 2


def test_a_long_interval_is_judged_as_a_short_one_where_the_period_is_known():
    first, second = pair((64, 120), 20, 0)
    for nominal_period, movement in ((0.0, Movement.LEFT), (0.1, Movement.FORWARD)):
        estimator = TrajectoryEstimator(EstimatorSettings(nominal_period=nominal_period))
        feed(estimator, [first, first])
        update = show(estimator, second, 3 * STEP_NS)
        assert update.step.movement is movement
        # What is published is what was measured.
        assert update.shift.dx == pytest.approx(20, abs=0.1)


def test_the_hint_is_about_the_shifts_that_are_coded():
    frames = pair((64, 120), 20, 0)
    estimator = TrajectoryEstimator(EstimatorSettings(threshold=16.0, nominal_period=0.1))
    for number in range(41):
        show(estimator, np.roll(frames[0], 20 * number, axis=1), 3 * STEP_NS * number)
    assert estimator.codes.movement.totals_of(Movement)[Movement.FORWARD] == 40
    assert estimator.threshold_hint.misfit is Misfit.TOO_HIGH


@pytest.mark.parametrize(('before', 'after'), [(0.0, 5.0), (5.0, 0.0)])
def test_whether_the_road_is_measured_is_fixed_at_the_start(before, after):
    settings = EstimatorSettings(
        code_source=CodeSource.AUTO, camera_height=1.5, speed=before)
    estimator = TrajectoryEstimator(settings)
    with pytest.raises(ValueError, match='whether the distance is measured on the road is fixed'):
        estimator.reconfigure(replace(settings, speed=after))


def test_another_encoding_is_not_compared():
    estimator = TrajectoryEstimator()
    show(estimator, FRAME, 0, encoding='mono8')
    assert show(estimator, TURNED, STEP_NS, encoding='rgb8').status is PairStatus.REPRIMED
    assert show(estimator, TURNED.astype(np.uint16), 2 * STEP_NS, encoding='rgb8').status is (
        PairStatus.REPRIMED)


def test_another_view_is_not_compared_and_codes_are_kept():
    estimator = TrajectoryEstimator()
    feed(estimator, [FRAME, FRAME])
    estimator.reconfigure(replace(estimator.settings, view=View(decimation=2)))
    assert show(estimator, TURNED, 2 * STEP_NS).status is PairStatus.REPRIMED
    assert len(estimator.codes.movement) == 2
    update = show(estimator, FRAME, 3 * STEP_NS)
    assert update.step.movement is Movement.RIGHT


def test_settings_that_are_wrong_change_nothing():
    estimator = TrajectoryEstimator()
    with pytest.raises(ValueError, match='threshold'):
        estimator.reconfigure(EstimatorSettings(threshold=0.0, view=View(decimation=2)))
    assert estimator.settings == EstimatorSettings()
    for name in ('max_gap', 'nominal_period'):
        with pytest.raises(ValueError, match=name):
            EstimatorSettings(**{name: -1.0})


SLIVER = EstimatorSettings(
    lens=Lens(hfov_deg=80.0), code_source=CodeSource.HEADING, view=View(decimation=40))


def test_the_heading_does_not_mind_a_view_too_small_to_correlate():
    assert feed(TrajectoryEstimator(SLIVER), [FRAME, FRAME])[1].status is PairStatus.OK


def test_a_view_too_small_for_the_test_of_stillness_is_refused():
    estimator = TrajectoryEstimator(replace(SLIVER, stillness=StillnessSettings(seconds=0.2)))
    with pytest.raises(FrameError, match='at least 8x8'):
        show(estimator, FRAME, 0)
    assert estimator.frames == 0


def test_ten_thousand_pairs_of_flicker_stay_bounded():
    estimator = TrajectoryEstimator(EstimatorSettings(max_runs=50, max_corners=20))
    for index in range(10_000):
        estimator.codes.update(100.0 if index % 3 else -100.0)
        estimator.path.append(estimator.codes.heading, index)
    assert len(estimator.codes.movement.runs) == len(estimator.codes.direction.runs) == 50
    assert len(estimator.path.corners) == 20
    assert len(estimator.codes.movement) == 10_000
