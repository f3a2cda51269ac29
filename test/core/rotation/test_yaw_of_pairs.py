# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Yaw of single pairs of frames, from a long lens and a far scene."""

from dataclasses import replace
import math
from types import SimpleNamespace

import cv2
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.rotation import camera_motion, yaw_meter
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.scanline import Scanline
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.whole_shift import WholeShift
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement, YawMeter
import pytest

FAR = cv2.GaussianBlur(
    np.random.default_rng(0).normal(size=(240, 900)).astype(np.float32), (0, 0), 1.5)
FAR = np.clip(128 + 50 * FAR / FAR.std(), 0, 255).astype(np.uint8)
LONG_FOCAL = 800.0


def far(moved):
    """Return what a camera with a long lens sees of a far scene, moved to the right by pixels."""
    return np.ascontiguousarray(FAR[:, 300 - moved:620 - moved])


def cylinder(focal_px):
    return CylinderProjection(CameraModel.pinhole((240, 320), focal_px))


def meter_of_far():
    return YawMeter(cylinder(LONG_FOCAL))


def test_a_pair_has_the_share_of_its_time_since_the_keyframe():
    meter = meter_of_far()
    meter.update(far(0), 0.1)
    shares = [meter.update(far(0), 0.1).share for _ in range(10)]
    assert shares[:4] == pytest.approx([1, 1 / 2, 1 / 3, 1 / 4])
    # After half a second, there is another one.
    assert min(shares) >= 1 / 6 and shares.count(1.0) > 1


@pytest.mark.parametrize('step', [-10, 10])
def test_a_steady_turn_needs_one_search_for_the_blocks(step, monkeypatch):
    searches, search = [], cv2.calcOpticalFlowPyrLK
    monkeypatch.setattr(
        cv2, 'calcOpticalFlowPyrLK', lambda *those, **named: searches.append(1) or search(
            *those, **named))
    meter = meter_of_far()
    found = [meter.update(far(step * count), 0.1) for count in range(10)][1:]
    # It was not foreseen in the first pair.
    assert len(searches) == len(found) + 1
    assert [each.yaw * LONG_FOCAL for each in found] == pytest.approx([step] * 9, abs=0.15)


@pytest.mark.parametrize('light', [0.5, 1.6])
def test_a_sudden_change_of_the_exposure_moves_nothing(light):
    meter = meter_of_far()
    meter.update(far(0) // 2, 0.1)
    found = meter.update(cv2.convertScaleAbs(far(0) // 2, alpha=light), 0.1)
    assert found.motion is not None and found.agreement > 0.9
    assert found.yaw == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize('step', [0, 6])
def test_the_direction_of_travel_is_not_learned_where_nothing_passes_by(step):
    meter, rng = meter_of_far(), np.random.default_rng(1)

    def noisy(moved):
        return np.clip(far(moved) + rng.normal(0.0, 3.0, (240, 320)), 0, 255).astype(np.uint8)

    meter.update(noisy(-200), 0.1)
    meter._key = meter._matcher.keyframe(meter._previous, FocusOfExpansion(course=0.3))
    for number in range(1, 70):
        measured = meter.update(noisy(-200 + step * number), 0.1)
    assert measured.yaw == pytest.approx(step / LONG_FOCAL, abs=0.0003)
    # The sway of a vehicle ends within seconds.
    assert abs(meter._key.travel.course) < 0.01


@pytest.mark.parametrize('step', [-2, 2])
def test_what_stays_while_the_camera_turns_is_fixed_to_it(step):
    """Above the road, too, where far parts of a scene may rest while the vehicle drives ahead."""
    meter = meter_of_far()
    for count in range(12):
        frame = far(step * count)
        frame[5:115, 60:240] = far(0)[5:115, 60:240]
        meter.update(frame, 0.1)
    x, y = meter._matcher.grid.centres.T
    fixed = meter._matcher.grid.fixed
    assert fixed[(y < 105) & (x > 70) & (x < 220)].mean() > 0.9
    assert not fixed[(y > 125) | (x < 50) | (x > 250)].any()


def test_nothing_is_fixed_to_a_camera_that_stands():
    """The road, which must move while the vehicle drives, rests as well."""
    meter = YawMeter(cylinder(200.0))
    for _ in range(30):
        meter.update(far(0), 0.1)
    assert not meter._matcher.grid.fixed.any()


def test_a_line_tells_to_which_side_the_image_has_moved_farther_than_foreseen():
    line = Scanline(cylinder(LONG_FOCAL), far(0))
    for moved, foreseen in ((6, 4.0), (2, 4.0), (-5, -3.0), (3, 3.0)):
        assert line.shift_error(far(moved), foreseen) == pytest.approx(moved - foreseen, abs=0.3)


def test_a_frame_is_foreseen_while_the_image_moves_as_before():
    meter = meter_of_far()
    assert not meter.foresees(far(0), 0.02, 0.02)
    for count in range(4):
        meter.update(far(4 * count), 0.04)
    # Half a period later, it has moved by half as much; in another light, too.
    assert meter.foresees(far(14), 0.02, 0.02)
    assert meter.foresees(far(14) // 2 + 60, 0.02, 0.02)
    for wrong in (far(12), far(16), far(100), np.ascontiguousarray(far(14)[:, ::-1])):
        assert not meter.foresees(wrong, 0.02, 0.02)
    # The next one would come too late.
    assert not meter.foresees(far(14), 0.02, 0.2)


def test_a_yaw_by_the_shift_alone_is_unsure_by_tenths_of_a_degree():
    whole = YawMeasurement(Shift(1.0, 0.0, 0.1), 0.01, 0.1)
    assert 0.1 < math.degrees(math.sqrt(whole.variance)) < 1.0
    part = YawMeasurement(Shift(1.0, 0.0, 0.1), 0.01, 0.8, share=0.25)
    assert part.variance == pytest.approx(whole.variance / 4)
    assert not whole.certain


def hidden(moved, share, number):
    """Return the far scene with a share of its columns hidden by noise, of its own per frame."""
    frame = far(moved)
    columns = round(share * frame.shape[1])
    noise = cv2.GaussianBlur(
        np.random.default_rng(number).normal(size=(240, columns)).astype(np.float32), (0, 0), 1.5)
    frame[:, :columns] = np.clip(128 + 50 * noise / noise.std(), 0, 255)
    return frame


@pytest.mark.parametrize('stands_out', [True, False])
def test_few_blocks_count_if_the_whole_shift_confirms_them(stands_out, monkeypatch):
    monkeypatch.setattr(
        WholeShift, 'significance', lambda *_: 1.1 * stands_out * TUNING.min_significance)
    meter = meter_of_far()
    meter.update(hidden(0, 0.7, 0), 0.1)
    found = meter.update(hidden(12, 0.7, 1), 0.1)
    assert TUNING.confirmed_share <= found.agreement < TUNING.min_agreement
    assert found.shift.dx == pytest.approx(12, abs=1.0)
    assert (found.motion is not None) is stands_out and not found.certain
    right = pytest.approx(12 / LONG_FOCAL, abs=0.3 / LONG_FOCAL)
    assert found.yaw == (right if stands_out else None)


def test_few_blocks_that_contradict_the_whole_shift_are_no_measurement(monkeypatch):
    monkeypatch.setattr(WholeShift, 'update', lambda whole, picture: Shift(60.0, 0.0, 0.2))
    monkeypatch.setattr(WholeShift, 'significance', lambda whole, shift: 20.0)
    for share, told in ((0.7, False), (0.9, True)):
        meter = meter_of_far()
        meter.update(hidden(0, share, 0), 0.1)
        meter._rate = 12 / LONG_FOCAL / 0.1
        found = meter.update(hidden(12, share, 1), 0.1)
        assert found.motion is None
        # Where the blocks tell nothing, the shift alone counts.
        assert (found.yaw is not None) is told


def test_a_few_blocks_count_for_nothing_however_well_they_agree(monkeypatch):
    monkeypatch.setattr(WholeShift, 'significance', lambda *_: 20.0)
    meter = meter_of_far()
    meter.update(far(0), 0.1)
    many = meter.update(far(3), 0.1)
    assert many.certain
    for factor, refined in ((0.99, True), (1.5, False)):
        monkeypatch.setattr(camera_motion, 'TUNING', replace(
            TUNING, min_blocks=factor * many.motion.agreeing))
        meter.reset()
        meter.update(far(0), 0.1)
        found = meter.update(far(3), 0.1)
        assert found.agreement == many.agreement
        assert (found.motion is not None, found.certain) == (refined, refined)
        # The shift alone counts.
        assert found.yaw == pytest.approx(3 / LONG_FOCAL, abs=0.5 / LONG_FOCAL)


def test_the_fewer_blocks_agree_the_less_certain_is_the_yaw():
    meter = meter_of_far()
    meter.update(far(0), 0.1)
    motion = meter.update(far(3), 0.1).motion
    whole, half, fifth = (
        YawMeasurement(
            Shift(3.0, 0.0, 0.1), motion.yaw, share, replace(motion, agreement=share)
        ).variance for share in (1.0, 0.5, 0.2))
    assert whole == half == pytest.approx(motion.yaw_variance)
    assert fifth == pytest.approx(2.5 ** 2 * half)


@pytest.mark.parametrize('focal_px', [LONG_FOCAL, 12.0 * LONG_FOCAL])
def test_no_lens_is_so_long_that_the_yaw_is_sure_to_less_than_a_hundredth_of_a_degree(focal_px):
    meter = YawMeter(cylinder(focal_px))
    meter.update(far(0), 0.1)
    found = meter.update(far(1), 0.1)
    assert found.motion is not None
    assert math.sqrt(found.variance) > math.radians(0.01)


@pytest.mark.parametrize(('agreement', 'passing', 'told'), [
    (0.3, 0.0, True), (0.1, 0.0, False), (0.6, 0.0, False), (0.3, 0.05, False)])
def test_blocks_that_show_drops_are_few_but_some_and_pass_nothing(agreement, passing, told):
    motion = CameraMotion(
        0.0, 0.0, 0.0, FocusOfExpansion(), 100.0 * agreement, agreement, 1e-6, passing)
    assert yaw_meter._may_show_drops(motion) is told


@pytest.mark.parametrize(('blocks_px', 'first', 'second', 'significance', 'expected'), [
    (0.0, (0.3, 0.2), (25.0, 0.5), 20.0, 25.0),
    (0.0, (-25.0, 0.5), (0.0, 0.0), 20.0, -25.0),
    (0.0, (0.3, 0.2), (25.0, 0.5), 4.0, None),
    # An object that passes on the road moves downwards, too.
    (0.0, (0.3, 0.2), (25.0, 3.0), 20.0, None),
    (0.0, (0.3, 0.2), (1.0, 0.0), 20.0, None),
    # The blocks follow the first peak.
    (12.0, (14.0, 0.5), (0.0, 0.0), 20.0, None)])
def test_the_shift_beside_that_of_drops_is_sideways(
        blocks_px, first, second, significance, expected, monkeypatch):
    monkeypatch.setattr(WholeShift, 'significance', lambda *_: significance)
    monkeypatch.setattr(WholeShift, 'second_peak', lambda _: Shift(*second, 0.1))
    meter = meter_of_far()
    yaw = blocks_px / meter._projection.px_per_rad
    match = SimpleNamespace(motion=SimpleNamespace(yaw=yaw + 0.02), key=SimpleNamespace(yaw=0.02))
    found = meter._shift_beside(match, Shift(*first, 0.1))
    assert (found and found.dx) == expected
