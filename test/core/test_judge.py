# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A pair of frames gets its status and its worth from what was measured, and in one place."""

from dataclasses import replace

import cv2
import numpy as np
from phase_traj_ros.core import (
    CodeSource,
    EstimatorSettings,
    Lens,
    PairStatus,
    Shift,
    TrajectoryEstimator,
)
from phase_traj_ros.core.correlation.quality import Quality
from phase_traj_ros.core.fixed.guard import FixedGuard
from phase_traj_ros.core.judge import judge, Verdict
from phase_traj_ros.core.measuring import Comparison
from phase_traj_ros.core.reliability.reason import Evidence
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
import pytest

SHIFT = Shift(1.0, 0.0, 0.2)
GOOD = Comparison(SHIFT, None, Quality.MEASURED, agreement=0.8)
SCATTERED = Comparison(SHIFT, None, Quality.MEASURED, agreement=0.2)
STILL = Comparison(SHIFT, None, Quality.STILL, agreement=0.8)
NOTHING = Comparison(SHIFT, None, Quality.NOTHING, agreement=0.8)


DARK, DIRTY = replace(GOOD, blank=True), replace(GOOD, fixed=True)


@pytest.mark.parametrize(('pair', 'admitted', 'status', 'evidence'), [
    (GOOD, True, PairStatus.OK, Evidence.TRUSTED),
    (SCATTERED, True, PairStatus.OK, Evidence.SCATTERED),
    (STILL, True, PairStatus.STILL, Evidence.STILL),
    (NOTHING, True, PairStatus.NO_MEASUREMENT, Evidence.BLANK),
    (Comparison(), True, PairStatus.REPRIMED, Evidence.APART),
    (Comparison(gap=True), True, PairStatus.GAP, Evidence.APART),
    (DARK, True, PairStatus.OK, Evidence.BLANK),
    (GOOD, False, PairStatus.NO_MEASUREMENT, Evidence.JERKED),
    (DIRTY, False, PairStatus.NO_MEASUREMENT, Evidence.FIXED),
    (SCATTERED, False, PairStatus.NO_MEASUREMENT, Evidence.SCATTERED),
    # A vehicle that stands does not turn, and shows nothing but noise at night.
    (replace(STILL, blank=True), False, PairStatus.STILL, Evidence.STILL)])
def test_a_pair_is_judged_by_the_first_thing_that_speaks_against_it(
        pair, admitted, status, evidence):
    assert judge(pair, admitted=admitted) == Verdict(status, evidence)


def test_the_rule_of_the_paper_codes_a_shift_whatever_the_yaw():
    assert judge(GOOD, admitted=False, by_yaw=False) == Verdict(PairStatus.OK, Evidence.JERKED)


def turning(yaw=0.02, quality=Quality.MEASURED, among=0.8, **options):
    motion = CameraMotion(
        yaw, 0.0, 0.0, FocusOfExpansion(), 100.0 * among, among, 1e-6, passing=0.0)
    measured = YawMeasurement(Shift(0.2, 0.0, 0.2), yaw, among, motion)
    return Comparison(measured.shift, measured, quality, agreement=0.8, **options)


def examined(guard, picture, pair, interval=0.1, **known):
    """Return the pair with what the guard finds, and whether the areas have changed."""
    found = guard.examine(picture, pair.yaw, pair.quality, interval, **known)
    return replace(pair, quality=found.quality, blank=found.blank, fixed=found.fixed,
                   slides=found.slides), found.changed


def guarded(pictures, pair, **known):
    """Return a guard that has seen the pictures with such pairs, and the newest pair."""
    guard = FixedGuard()
    guard.start(pictures[0])
    for picture in pictures[1:]:
        newest, _ = examined(guard, picture, pair, **known)
    return guard, newest


def judged_after(pictures, pair, *, admitted=True, **known):
    """Return the verdict on the last of these pictures."""
    return judge(guarded(pictures, pair, **known)[1], admitted=admitted)


@pytest.fixture(scope='module')
def street():
    noise = np.random.default_rng(0).integers(0, 256, (120, 800)).astype(np.uint8)
    wide = cv2.GaussianBlur(noise, (0, 0), 2.0)
    return [cv2.normalize(wide[:, 6 * step:6 * step + 160], None, 0, 255, cv2.NORM_MINMAX)
            for step in range(60)]


def test_a_pair_of_a_moving_street_is_integrated_as_it_is(street):
    verdict = judged_after(street, turning())
    assert (verdict.status, verdict.evidence) == (PairStatus.OK, Evidence.TRUSTED)
    assert verdict.yaw == turning().yaw


def test_a_standing_vehicle_does_not_turn_whatever_passes_by(street):
    lorry = [street[0].copy() for _ in street]
    for picture, moving in zip(lorry, street):
        picture[80:] = moving[80:]
    verdict = judged_after(lorry, turning(quality=Quality.STILL))
    assert (verdict.status, verdict.yaw.yaw) == (PairStatus.STILL, 0.0)


def test_a_vehicle_that_turns_drives_though_the_blocks_with_most_texture_stand(street):
    turned = turning(quality=Quality.STILL)
    verdict = judged_after(street, turned)
    assert (verdict.status, verdict.yaw) == (PairStatus.OK, turned.yaw)
    # Everything changes in the noise of a night, too, but no blocks agree on a turn.
    slow = turning(yaw=0.002, quality=Quality.STILL)
    assert judged_after(street, slow).status is PairStatus.STILL


@pytest.mark.parametrize(('quality', 'status'), [
    (Quality.MEASURED, PairStatus.STILL), (Quality.STILL, PairStatus.STILL),
    (Quality.NOTHING, PairStatus.NO_MEASUREMENT), (None, PairStatus.REPRIMED)])
def test_a_vehicle_in_front_of_which_traffic_moves_stands(street, quality, status):
    pair = turning(yaw=0.04, quality=quality)
    pair = replace(pair, yaw=replace(pair.yaw, is_traffic=True))
    verdict = judged_after([street[0]] * 3, pair)
    assert verdict.status is status
    if status is PairStatus.STILL:
        assert verdict.yaw.yaw == 0.0


@pytest.mark.parametrize(('rate', 'status'), [
    (0.4, PairStatus.OK), (-0.4, PairStatus.STILL), (0.0, PairStatus.STILL)])
def test_a_turn_that_goes_on_is_none_of_a_standing_vehicle(street, rate, status):
    """Fewer blocks agree than would show the begin of a turn."""
    pair = turning(yaw=0.04, quality=Quality.STILL, among=0.45)
    assert judged_after(street, pair, yaw_rate=rate).status is status


def test_a_pair_on_which_no_vehicle_turns_like_that_is_not_measured(street):
    verdict = judged_after(street, turning(), admitted=False)
    assert (verdict.status, verdict.evidence) == (PairStatus.NO_MEASUREMENT, Evidence.JERKED)


def seen_through_dirt(street):
    """Most of the picture does not change while a part of it does."""
    pictures = [street[0].copy() for _ in street]
    for picture, moving in zip(pictures, street):
        picture[:, :50] = moving[:, :50]
    return pictures


def test_where_only_dirt_agrees_the_yaw_is_rejected(street):
    verdict = judged_after(seen_through_dirt(street), turning())
    assert (verdict.status, verdict.evidence) == (PairStatus.NO_MEASUREMENT, Evidence.FIXED)
    assert verdict.yaw.yaw is None


@pytest.mark.parametrize(('passing', 'evidence'), [
    (0.02, Evidence.TRUSTED), (0.001, Evidence.FIXED)])
def test_what_passes_by_is_not_dirt_however_little_else_moves(street, passing, evidence):
    passes = CameraMotion(0.0, 0.0, 0.0, FocusOfExpansion(), 100.0, 0.8, 1e-8, passing)
    pair = turning()
    pair = replace(pair, yaw=replace(pair.yaw, motion=passes))
    assert judged_after(seen_through_dirt(street), pair).evidence is evidence


@pytest.mark.parametrize(('agreement', 'speed', 'status'), [
    (0.8, 8.0, PairStatus.OK), (0.8, 0.0, PairStatus.NO_MEASUREMENT),
    (0.8, None, PairStatus.NO_MEASUREMENT), (0.6, 8.0, PairStatus.NO_MEASUREMENT)])
def test_where_the_road_slides_by_the_yaw_counts_but_is_no_evidence(
        street, agreement, speed, status):
    """On an open road, half of the blocks are so far away that they do not move."""
    far = CameraMotion(0.0, 0.0, 0.0, FocusOfExpansion(), 100.0, agreement, 1e-8, 0.001)
    pair = turning()
    pair = replace(pair, yaw=replace(pair.yaw, motion=far, agreement=agreement))
    verdict = judged_after(seen_through_dirt(street), pair, speed=speed)
    assert (verdict.status, verdict.evidence) == (status, Evidence.FIXED)
    assert (verdict.yaw.yaw is None) == (status is PairStatus.NO_MEASUREMENT)


def test_a_cut_does_not_make_the_next_scene_doubtful(street):
    guard, _ = guarded(seen_through_dirt(street), turning())
    guard.interrupt()
    pair, _ = examined(guard, street[0], turning())
    assert judge(pair).evidence is Evidence.TRUSTED


def test_what_is_fixed_is_told_when_it_is_found_and_kept_over_a_reset(street):
    """A bar that is never lit covers a quarter of the picture."""
    guard, told = FixedGuard(), []
    guard.start(street[0])
    for picture in street[1:]:
        barred = picture.copy()
        barred[:, :40] = 0
        told.append(examined(guard, barred, turning())[1])
    assert any(told) and not told[0]
    assert (guard.excluded[:, :35] == 0).all() and (guard.excluded[:, 60:] == 255).all()
    guard.interrupt()
    assert guard.excluded is not None


@pytest.mark.parametrize('apart', [Comparison(gap=True), Comparison()])
def test_frames_that_are_not_compared_end_what_was_seen_before(street, apart):
    pictures = seen_through_dirt(street)
    guard, _ = guarded(pictures, turning())
    pair, _ = examined(guard, pictures[0], turning())
    assert judge(pair).evidence is Evidence.FIXED
    examined(guard, pictures[1], apart, 9.0)
    pair, _ = examined(guard, street[2], turning())
    assert judge(pair).evidence is Evidence.TRUSTED


@pytest.mark.parametrize('source', [CodeSource.AUTO, CodeSource.HEADING])
def test_only_in_auto_something_is_left_out(street, source):
    """A bar that is never lit covers a quarter of the picture."""
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=source, lens=Lens(focal_px=150.0)))
    for number, picture in enumerate(street):
        barred = picture.copy()
        barred[:, :40] = 0
        estimator.update(barred, number * 10 ** 8)
    assert (estimator.left_out is not None) == (source is CodeSource.AUTO)
