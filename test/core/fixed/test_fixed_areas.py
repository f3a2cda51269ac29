# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Areas fixed to the camera are found, and no others."""

from functools import partial

import cv2
import numpy as np
import overlays
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.fixed.fixed_areas import FixedAreas
from phase_traj_ros.core.fixed.picture_samples import PictureSamples
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import night, sensor_noise
import pytest

CAMERA = Camera.with_field_of_view(320, 240, 70)
RATE = 6.0


def drive_of(*plan):
    drive = plan_drive('a drive', list(plan), rate_hz=RATE, camera=CAMERA, speed=6.0, seed=4)
    return list(render_drive(drive))


@pytest.fixture(scope='module')
def right():
    return drive_of(Straight(3.0), Turn(-90.0, 3.0, 4.5), Straight(6.0))


@pytest.fixture(scope='module')
def straight():
    return drive_of(Straight(13.0))


def learned(frames, *, areas=None, turned=0.0):
    areas = FixedAreas() if areas is None else areas
    for number, frame in enumerate(frames):
        areas.update(frame, 1 / RATE if number else 0.0, turned=turned)
    return areas


def found(areas, hidden):
    """Return the share of the fixed areas that is found, and of the rest that is mistaken."""
    weights = areas.weights()
    fixed = np.zeros(hidden.shape, bool) if weights is None else weights == 0
    near = cv2.dilate(hidden.astype(np.uint8), np.ones((25, 25))) > 0
    return (fixed & hidden).sum() / max(hidden.sum(), 1), (fixed & ~near).mean()


def hidden_by(overlay):
    dark, bright = (np.full((240, 320), level, np.uint8) for level in (90, 110))
    return overlay(dark) == overlay(bright)


@pytest.mark.parametrize(('overlay', 'least'), [
    (lambda frame: overlays.black_bars(frame, sides=0.1), 0.99),
    (lambda frame: overlays.black_bars(frame, ends=0.12), 0.99),
    (lambda frame: overlays.burnt_in_text(frame, '2026-03-01 12:34:56 CAM1'), 0.6),
])
def test_bars_and_text_are_found(right, overlay, least):
    recall, wrong = found(learned(map(overlay, right)), hidden_by(overlay))
    assert recall > least
    assert wrong < 0.02


def test_a_bonnet_is_found_in_turns(right):
    areas = FixedAreas()
    for number, frame in enumerate(map(overlays.bonnet, right)):
        turning = RATE * 3 <= number < RATE * 7
        areas.update(frame, 1 / RATE if number else 0.0, turned=40.0 if turning else 0.0)
    recall, wrong = found(areas, hidden_by(overlays.bonnet))
    assert recall > 0.8
    assert wrong < 0.02


@pytest.mark.parametrize('softness', [0.05, 0.3])
@pytest.mark.parametrize('drive', ['right', 'straight'])
def test_drops_are_found_on_any_road(drive, softness, request):
    def wet(frame):
        return overlays.drops(frame, count=80, softness=softness)

    frames = request.getfixturevalue(drive)
    hidden = wet(np.zeros((240, 320), np.uint8)) != 0
    recall, wrong = found(learned(map(wet, frames)), hidden)
    assert recall > 0.4
    assert wrong < 0.06


@pytest.mark.parametrize('drive', ['right', 'straight'])
def test_the_world_is_not_fixed(drive, request):
    areas = learned(request.getfixturevalue(drive))
    assert areas.share < 0.03
    assert areas.sufficient


def test_learned_areas_fade_once_they_move(right):
    areas = learned(overlays.drops(frame, count=80) for frame in right)
    assert areas.share > 0.05
    learned(right * 3, areas=areas)
    assert areas.share < 0.02


def test_a_stationary_vehicle_learns_nothing(right):
    rng = np.random.default_rng(3)
    noisy = (np.clip(right[0] + rng.normal(0, 3, right[0].shape), 0, 255).astype(np.uint8)
             for _ in range(120))
    areas = learned(noisy)
    assert areas.weights() is None
    assert not areas.moving


@pytest.mark.parametrize('degraded', [
    partial(night, exposure=0.06), partial(night, exposure=0.03), partial(sensor_noise, sigma=14)])
def test_the_noise_of_a_stationary_vehicle_is_not_motion(right, degraded):
    areas = FixedAreas()
    assert doubted((degraded(right[0], seed=number) for number in range(60)), areas) == 0.0
    assert areas.weights() is None


def test_noise_of_a_stream_that_hangs_is_not_motion(right):
    areas = learned(night(right[0], exposure=0.06, seed=number // 6) for number in range(240))
    assert areas.weights() is None
    assert not areas.doubts(Shift(0.0, 0.0, 0.3), agreed=False)


@pytest.mark.parametrize('light', [0.05, 0.02])
def test_noise_of_half_a_grey_level_is_not_motion(right, light):
    dark = light * right[0]
    areas = FixedAreas()
    assert doubted((sensor_noise(dark, sigma=0.5, seed=number) for number in range(60)),
                   areas) == 0.0
    assert areas.weights() is None


def test_fine_texture_that_moves_slowly_is_not_noise():
    camera = Camera.with_field_of_view(160, 120, 70)
    drive = plan_drive('slow', [Straight(10.0)], rate_hz=10.0, camera=camera, speed=0.3, seed=2)
    areas, doubts = FixedAreas(), []
    for number, frame in enumerate(render_drive(drive)):
        areas.update(frame, 0.1 if number else 0.0)
        doubts.append(areas.doubts(Shift(0.0, 0.0, 0.3), agreed=True))
    assert not any(doubts)


def test_a_pattern_of_pixels_that_stays_is_not_noise(right):
    """As in a dithered image, or one in the colours of the sensor."""
    mosaic = 0.3 + 0.7 * (np.indices((240, 320)).sum(axis=0) % 2)
    frames = [overlays.black_bars(frame, sides=0.1) for frame in right]
    areas = learned((mosaic * frame).astype(np.uint8) for frame in frames)
    assert areas.share > 0.15
    assert learned((mosaic * frame).astype(np.uint8) for frame in right).moving


def test_the_world_moves_at_night_too(straight):
    areas = learned(night(frame, exposure=0.06, seed=number)
                    for number, frame in enumerate(straight[:30]))
    assert areas.moving
    assert not areas.doubts(Shift(0.2, 0.0, 0.3), agreed=True)


def test_cross_traffic_does_not_make_the_houses_fixed(right):
    def crossing(number):
        frame = right[0].copy()
        frame[110:170] = np.roll(right[5][110:170], 17 * number, axis=1)
        return frame

    areas = learned(crossing(number) for number in range(200))
    assert areas.share < 0.02


def doubted(frames, areas):
    """Return the share of the frames after which a shift of zero is doubted."""
    doubts = []
    for number, frame in enumerate(frames):
        areas.update(frame, 1 / RATE if number else 0.0)
        doubts.append(areas.doubts(Shift(0.2, 0.0, 0.3), agreed=True))
    return np.mean(doubts)


@pytest.mark.parametrize(('drive', 'count', 'least', 'most'), [
    ('straight', 0, 0.0, 0.0), ('straight', 60, 0.0, 0.1), ('straight', 400, 0.5, 1.0),
    ('right', 0, 0.0, 0.0), ('right', 60, 0.0, 0.1), ('right', 400, 0.4, 1.0)])
def test_zero_is_doubted_where_the_drops_leave_too_little(drive, count, least, most, request):
    frames = request.getfixturevalue(drive)
    areas = FixedAreas()
    wet = (overlays.drops(frame, count=count, size=0.022, softness=0.1, seed=2)
           for frame in frames)
    assert least <= doubted(wet, areas) <= most
    # A shift other than zero cannot come from drops.
    assert not areas.doubts(Shift(3.0, 0.0, 0.3), agreed=True)


def test_a_creeping_vehicle_is_not_doubted(straight):
    areas = FixedAreas()
    slowly = 0.0
    for frame in straight[:40]:
        areas.update(frame, slowly)
        assert not areas.doubts(Shift(0.2, 0.0, 0.3), agreed=True)
        # At 0.8 m/s.
        slowly = 6.0 / RATE / 0.8


def test_a_stationary_vehicle_is_not_doubted(right):
    areas = FixedAreas()
    assert doubted([right[0]] * 30, areas) == 0.0
    assert not areas.doubts(Shift(0.0, 0.0, 1.0), agreed=False)


@pytest.mark.parametrize('metres', [0.1, 0.2, 0.4])
def test_a_stop_is_not_doubted_for_what_moved_before_it(metres):
    drive = plan_drive(
        'a stop', [Straight(3 * metres)], rate_hz=RATE, camera=CAMERA, speed=RATE * metres)
    driven = list(render_drive(drive))[:3]
    areas = FixedAreas()
    for frame in driven + driven[-1:] * 12:
        areas.update(frame, 0.5)
        assert not areas.doubts(Shift(0.2, 0.0, 0.3), agreed=True)


def test_zero_is_doubted_where_the_blocks_disagree_and_the_world_moves(right):
    areas = learned(right[:10])
    assert areas.doubts(Shift(0.0, 0.0, 0.3), agreed=False)
    assert not areas.doubts(Shift(0.0, 0.0, 0.3), agreed=True)


def test_half_a_picture_of_drops_leaves_too_little(right):
    hidden = [overlays.drops(frame, count=160, size=0.03, softness=0.1, seed=2)
              for frame in right]
    areas = FixedAreas()
    for number, frame in enumerate(hidden * 3):
        areas.update(frame, 1 / RATE if number else 0.0, turned=40.0)
    assert not areas.sufficient


def test_wide_bars_leave_a_small_picture_that_suffices(right):
    areas = learned(overlays.black_bars(frame, sides=0.3) for frame in right)
    assert areas.share > 0.59
    assert areas.sufficient


def test_another_size_restarts_learning(right):
    barred = [overlays.black_bars(frame, sides=0.1) for frame in right]
    areas = learned(barred)
    assert areas.weights().shape == (240, 320)
    areas.update(barred[0][:120], 1 / RATE)
    assert (areas.weights(), areas.share) == (None, 0.0)


@pytest.mark.parametrize('shape', [(416, 1301), (376, 1241), (1080, 1920), (90, 120)])
def test_what_is_found_in_samples_is_left_out_where_it_is(shape):
    samples = PictureSamples(shape)
    where = np.zeros(shape, np.uint8)
    where[20:60, shape[1] - 40:] = 255
    samples.take(where, 0.0, 0.0)
    seen = (samples.picture > 0.5 * samples.picture.max()).astype(np.uint8)
    assert (samples.enlarged(seen, shape) != where / 255).mean() < 0.005


def test_an_interruption_compares_no_frames_across_it(right):
    areas = learned(right[:10])
    assert areas.moving
    areas.interrupt()
    areas.update(right[30], 1.0)
    assert not areas.moving


@pytest.mark.parametrize('kind', [np.uint16, np.float32])
def test_the_range_of_the_grey_levels_does_not_matter(right, kind):
    scale = kind(257 if kind is np.uint16 else 1 / 255)
    bars = [overlays.black_bars(frame, sides=0.1) for frame in right[:40]]
    expected = learned(bars).weights()
    given = learned(frame.astype(kind) * scale for frame in bars).weights()
    assert (given != expected).mean() < 0.02
