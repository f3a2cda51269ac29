# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Patches of noise that slide by a known number of cells; rows run from far to near."""

import cv2
import numpy as np
from phase_traj_ros.core.correlation.windows import window_2d
from phase_traj_ros.core.road.patch_correlator import PatchCorrelator
from phase_traj_ros.core.road.tuning import TUNING
import pytest

SHAPE = 90, 140
WINDOW = window_2d(SHAPE)


def road(seed=0):
    """Return white noise, limited to what cells can show, that may slide by parts of a cell."""
    return np.fft.fft2(np.random.default_rng(seed).normal(size=(256, 256)))


def patch(road, cells, aside=0.0):
    """Return the patch of a road that has come nearer by ``cells``."""
    down, right = np.meshgrid(np.fft.fftfreq(256), np.fft.fftfreq(256), indexing='ij')
    soft = np.exp(-4.0 * (down ** 2 + right ** 2))
    moved = np.fft.ifft2(road * soft * np.exp(-2j * np.pi * (down * cells + right * aside))).real
    return moved[80:80 + SHAPE[0], 50:50 + SHAPE[1]].astype(np.float32)


def compared(before, after, *, blur_cells=0.0):
    slide = PatchCorrelator(WINDOW, blur_cells=blur_cells)
    slide.set_reference(before)
    slide.compare(after)
    return slide


def test_a_slide_towards_the_vehicle_is_positive_and_as_exact_as_it_says():
    slide, errors = PatchCorrelator(WINDOW), []
    slide.set_reference(patch(road(), 0.0))
    for cells in np.arange(-8.0, 50.0, 1.9):
        slide.compare(patch(road(), cells))
        errors.append(slide.peak(-10, slide.max_cells).cells - cells)
    assert np.sqrt(np.mean(np.square(errors))) < TUNING.peak_cells
    assert abs(np.mean(errors)) < TUNING.peak_cells / 3.0


@pytest.mark.parametrize(('contrast', 'blur_cells'), [(1e-6, 0.0), (100.0, 0.0), (1.0, 2.0)])
def test_noise_stands_out_by_the_best_of_nine_columns(contrast, blur_cells):
    """The unit of a score is a standard deviation, whatever the contrast and the blur are."""
    told = []
    for seed in range(6):
        slide = compared(
            patch(road(seed), 0.0), np.float32(contrast) * patch(road(seed + 50), 0.0),
            blur_cells=blur_cells)
        told.append(slide.scores_at(np.arange(60.0)))
    best = np.random.default_rng(1).normal(size=(100_000, 9)).max(axis=1)
    assert np.mean(told) == pytest.approx(best.mean(), rel=0.15)
    assert np.std(told) == pytest.approx(best.std(), rel=0.25)


@pytest.mark.parametrize('blur', [1.0, 2.0])
def test_a_blurred_road_is_found_among_noise_that_is_sharper(blur):
    rng, errors, gains = np.random.default_rng(2), [], []
    for cells in np.arange(5.0, 35.0, 3.3):
        pair = []
        for way in (0.0, cells):
            seen = cv2.GaussianBlur(patch(road(), way), (1, 0), sigmaX=0.01, sigmaY=blur)
            pair.append(seen + seen.std() * rng.normal(size=SHAPE).astype(np.float32))
        slide = compared(*pair, blur_cells=np.sqrt(2) * blur)
        peak = slide.peak(-10, slide.max_cells)
        errors.append(peak.cells - cells)
        gains.append(peak.score / compared(*pair).max_score(cells - 3.0, cells + 3.0))
    assert np.sqrt(np.mean(np.square(errors))) < TUNING.peak_cells
    assert min(gains) > 1.3


def test_a_wide_peak_is_not_pulled_to_zero():
    """The map is the product of the peak and the overlap, which falls with the slide."""
    errors, rng = [], np.random.default_rng(3)
    for seed in range(8):
        slide = compared(*(
            cv2.GaussianBlur(patch(road(seed), way), (1, 0), sigmaX=0.01, sigmaY=3.0)
            + 0.02 * rng.normal(size=SHAPE).astype(np.float32) for way in (0.0, 40.0)),
            blur_cells=np.sqrt(2) * 3.0)
        errors.append(slide.peak(20.0, slide.max_cells).cells - 40.0)
    assert abs(np.mean(errors)) < TUNING.peak_cells


def test_what_moves_aside_as_well_is_found():
    slide = compared(patch(road(), 0.0), patch(road(), 10.0, TUNING.lateral_cells))
    assert slide.peak(0, slide.max_cells).cells == pytest.approx(10.0, abs=0.5)
    slide = compared(patch(road(), 0.0), patch(road(), 10.0, -TUNING.lateral_cells))
    assert slide.peak(0, slide.max_cells).cells == pytest.approx(10.0, abs=0.5)


def test_a_peak_is_sought_within_limits_and_a_flank_is_none():
    slide = compared(patch(road(), 0.0), patch(road(), 12.0) + 0.7 * patch(road(), 30.0))
    assert slide.peak(0, 20).cells == pytest.approx(12.0, abs=0.5)
    assert slide.peak(20, 40).cells == pytest.approx(30.0, abs=0.5)
    for limits in ((0, 11), (13, 29), (31, slide.max_cells)):
        outside = slide.peak(*limits)
        assert outside is None or outside.score < TUNING.min_score
    assert slide.peak(5, 4) is None


def test_the_rival_of_a_slide_is_the_highest_other_one():
    slide = compared(patch(road(), 0.0), patch(road(), 12.0) + 0.7 * patch(road(), 30.0))
    strong, weak = slide.peak(0, 20), slide.peak(20, 40)
    assert strong.score > weak.score > TUNING.min_score
    assert slide.rival_score(None) == slide.rival_score(weak.cells) == pytest.approx(strong.score)
    assert slide.rival_score(strong.cells) == pytest.approx(weak.score)
    # At the near end of the range as well.
    alone = compared(patch(road(), 0.0), patch(road(), -10.0))
    assert alone.rival_score(alone.peak(-12, 0).cells) < TUNING.min_score < alone.rival_score(None)


def test_the_height_at_a_slide_is_that_of_its_peak():
    slide = compared(patch(road(), 0.0), patch(road(), 12.0))
    peak = slide.peak(0, slide.max_cells)
    assert slide.scores_at(np.array([12.0]))[0] == pytest.approx(peak.score)
    assert slide.max_score(10.0, 14.0) == slide.max_score(-99.0, 99.0) == peak.score
    assert slide.max_score(20.0, 40.0) < TUNING.min_score
    # Beyond the range, nothing is known.
    assert np.isnan(slide.scores_at(np.array([-50.0, 100.0]))).all()


def test_a_reference_that_lies_ahead_shows_longer_slides():
    slide = compared(patch(road(), 0.0), patch(road(), 80.0))
    most = slide.max_cells
    assert slide.peak(0, most) is None
    slide.set_reference(patch(road(), 60.0), 60)
    assert slide.max_cells > most
    for cells in (50.0, 60.0, 80.0):
        slide.compare(patch(road(), cells))
        assert slide.peak(0, slide.max_cells).cells == pytest.approx(cells, abs=0.5)
    # The map is cyclic, but this is not a longer slide.
    slide.compare(patch(road(), 10.0))
    assert slide.peak(0, slide.max_cells) is None
    # As it was.
    slide.set_reference(patch(road(), 0.0))
    slide.compare(patch(road(), 0.0))
    assert slide.max_cells == most and slide.coherence > 0.9
    assert slide.peak(-10, most).cells == pytest.approx(0.0, abs=0.5)


def test_a_patch_without_contrast_is_like_none():
    blank = np.zeros(SHAPE, np.float32)
    for before, after in ((patch(road(), 0.0), blank), (blank, patch(road(), 0.0))):
        assert compared(before, after).rival_score(None) < TUNING.min_score
    slide = compared(patch(road(), 0.0), patch(road(), 0.0))
    slide.set_reference(blank)
    slide.compare(patch(road(), 0.0))
    assert slide.rival_score(None) < TUNING.min_score


def test_the_largest_slide_is_found():
    most = PatchCorrelator(WINDOW).max_cells
    slide = compared(patch(road(), 0.0), patch(road(), most - 1.0))
    assert slide.peak(most - 5, most).cells == pytest.approx(most - 1.0, abs=0.5)


def test_the_kept_patch_stays_for_the_next_comparison():
    slide = compared(patch(road(), 0.0), patch(road(), 5.0))
    slide.compare(patch(road(), 11.0))
    assert slide.peak(0, slide.max_cells).cells == pytest.approx(11.0, abs=0.5)
    slide.set_reference(patch(road(), 11.0))
    slide.compare(patch(road(), 14.0))
    assert slide.peak(0, slide.max_cells).cells == pytest.approx(3.0, abs=0.5)
