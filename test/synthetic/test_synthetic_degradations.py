# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Degradations have the requested amount, and are reproducible."""

import numpy as np
from phase_traj_ros.synthetic import degradations as spoil, KITTI_CAMERA
import pytest

GREY = np.full((376, 1241), 120, np.uint8)
STRIPES = np.tile(np.array([[60], [180]], np.uint8), (188, 1241))
RANDOM = {
    'noise': lambda frame, seed: spoil.sensor_noise(frame, sigma=10.0, seed=seed),
    'night': lambda frame, seed: spoil.night(frame, seed=seed),
    'rain': lambda frame, seed: spoil.rain(frame, seed=seed),
}


@pytest.mark.parametrize('name', RANDOM)
def test_randomness_comes_from_the_seed_alone(name):
    before = GREY.copy()
    (first, again, other) = (RANDOM[name](GREY, seed) for seed in ((1, 2), (1, 2), (1, 3)))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    np.testing.assert_array_equal(GREY, before)
    assert (first.dtype, first.shape) == (np.uint8, GREY.shape)


@pytest.mark.parametrize('sigma', [0.0, 3.0, 15.0])
def test_sensor_noise_has_its_deviation_and_no_bias(sigma):
    noisy = spoil.sensor_noise(GREY, sigma=sigma, seed=0).astype(float)
    assert noisy.mean() == pytest.approx(120, abs=0.1)
    assert noisy.std() == pytest.approx(sigma, abs=0.05 * sigma + 0.05)


def test_blur_takes_contrast_and_none_takes_nothing():
    np.testing.assert_array_equal(spoil.blur(STRIPES, sigma=0), STRIPES)
    assert spoil.blur(STRIPES, sigma=2.0).std() < 5


def test_gain_saturates():
    assert (spoil.gain(GREY, factor=0.5) == 60).all()
    assert (spoil.gain(GREY, factor=3.0) == 255).all()


def test_night_is_darker_and_noisier():
    dark = spoil.night(GREY, seed=0).astype(float)
    assert dark.mean() == pytest.approx(40, abs=3)
    assert dark.std() > 5
    assert spoil.night(GREY, exposure=0.6, seed=0).std() < dark.std() / 2


def test_fog_hides_the_distance_more_than_the_foreground():
    foggy = spoil.fog(STRIPES, visibility=20.0).astype(float)
    contrast = np.abs(np.diff(foggy, axis=0))[:, 0]
    horizon = round(KITTI_CAMERA.cy)
    assert contrast[-2] > 80
    # 40 m, twice the visibility: contrast has fallen to exp(-2).
    assert contrast[horizon] == pytest.approx(120 * np.exp(-2), abs=1.5)
    assert contrast[horizon] < contrast[20] < contrast[-2]
    assert foggy[horizon - 1:horizon + 1, 0].mean() > 165


def test_rain_only_brightens():
    rainy = spoil.rain(GREY, seed=0)
    assert (rainy >= GREY).all()
    assert 0.005 < (rainy > GREY).mean() < 0.3


def test_vibration_shakes_pitch_and_roll_only():
    poses = np.arange(5000.0).reshape(1000, 5)
    shaken = spoil.vibration(poses, pitch_deg=0.2, roll_deg=0.5, seed=0)
    np.testing.assert_array_equal(shaken[:, :3], poses[:, :3])
    deviation = np.degrees((shaken - poses)[:, 3:].std(axis=0))
    assert deviation == pytest.approx((0.2, 0.5), rel=0.1)


def test_frames_are_lost_by_their_share_but_never_the_first():
    kept = spoil.kept_frames(2000, lost=0.3, seed=1)
    assert kept[0] == 0
    assert (np.diff(kept) > 0).all()
    assert len(kept) == pytest.approx(1400, abs=80)
    np.testing.assert_array_equal(spoil.kept_frames(5, lost=0.0, seed=0), np.arange(5))


def test_a_film_is_the_same_every_time_and_coarser_at_a_higher_rate_factor():
    pytest.importorskip('av')
    frames = [spoil.sensor_noise(GREY, sigma=5.0, seed=seed) for seed in range(5)]
    (fine, again, coarse) = (
        spoil.encoded(frames, rate_factor=factor) for factor in (18, 18, 40))
    np.testing.assert_array_equal(fine, again)
    assert np.shape(fine) == (5, 376, 1240)
    (lost, more) = (
        np.abs(np.subtract(shown, np.array(frames)[:, :, :-1], dtype=float)).mean()
        for shown in (fine, coarse))
    assert 0 < lost < more
