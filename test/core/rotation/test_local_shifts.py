# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements of blocks, on textures moved by known fractions of a pixel."""

import math

import cv2
import numpy as np
from phase_traj_ros.core.rotation.local_shifts import BlockGrid
from phase_traj_ros.core.rotation.tuning import TUNING
import pytest
from textures import pair

SHAPE = (120, 360)
EVERYWHERE = np.ones(SHAPE, np.bool_)


def measure(dx, dy, expected=None, grid=None):
    first, second = pair(SHAPE, dx, dy)
    grid = grid or BlockGrid(EVERYWHERE)
    expected = (dx, dy) if expected is None else expected
    return grid, grid.measure(grid.extract(first), second, expected=expected)


@pytest.mark.parametrize(('dx', 'dy'), [(0.0, 0.0), (3.4, -1.3), (-17.8, 0.6), (40.25, 2.5)])
def test_measures_each_block_to_a_fraction_of_a_pixel(dx, dy):
    _, shifts = measure(dx, dy, expected=(round(dx), 0))
    sure = shifts.weight > 0.5
    assert sure.sum() > 100
    assert np.median(np.abs(shifts.dx[sure] - dx)) < 0.05
    assert np.median(np.abs(shifts.dy[sure] - dy)) < 0.05


def test_finds_what_is_not_quite_where_it_is_expected():
    _, shifts = measure(14.0, 3.0, expected=(0.0, 0.0))
    assert np.median(shifts.dx) == pytest.approx(14.0, abs=0.1)


def test_nine_blocks_of_ten_agree_in_compressed_pictures():
    pictures = [
        cv2.imdecode(cv2.imencode('.jpg', each, (cv2.IMWRITE_JPEG_QUALITY, 10))[1], 0)
        for each in pair(SHAPE, 3.4, -1.3)]
    grid = BlockGrid(EVERYWHERE)
    shifts = grid.measure(grid.extract(pictures[0]), pictures[1], expected=(3.0, 0.0))
    off = np.hypot(shifts.dx - 3.4, shifts.dy + 1.3)
    assert (off < TUNING.outlier_deviations * TUNING.block_deviation_px).mean() > 0.9


def test_blocks_without_texture_say_nothing():
    first, second = pair(SHAPE, 2.0, 0.0)
    first[:, :180] = second[:, :180] = 90
    grid = BlockGrid(EVERYWHERE)
    shifts = grid.measure(grid.extract(first), second, expected=(2.0, 0.0))
    left = grid.centres[:, 0] < 150
    assert shifts.weight[left].max() == 0.0
    assert np.median(shifts.weight[~left & (grid.centres[:, 0] > 210)]) > 0.5


def test_edges_say_nothing_as_a_shift_along_them_is_not_seen():
    # Stripes such as kerbs on the left, and noise that makes them look like more than that.
    first, second = pair(SHAPE, 2.0, 0.0)
    rows, columns = np.indices(SHAPE)
    noise = np.random.default_rng(3).normal(0.0, 4.0, (2, *SHAPE))
    for picture, seen in ((first, noise[0]), (second, noise[1])):
        stripes = 120 + 80 * np.sin((rows + 0.5 * columns) / 3.0) + seen
        picture[:, :180] = np.clip(stripes, 0, 255)[:, :180]
    grid = BlockGrid(EVERYWHERE)
    shifts = grid.measure(grid.extract(first), second, expected=(2.0, 0.0))
    left = grid.centres[:, 0] < 150
    assert np.median(shifts.weight[left]) == 0.0
    assert np.median(shifts.weight[~left & (grid.centres[:, 0] > 210)]) > 0.5


@pytest.mark.parametrize(('share', 'corners'), [(0.07, False), (0.14, True)])
def test_a_block_shows_a_corner_if_a_tenth_of_its_texture_is_across(share, corners):
    """Waves as long as a block, to the right and down."""
    rows, columns = np.indices(SHAPE) * (2 * math.pi / TUNING.block_px)
    waves = 128 + 90 * np.sin(columns) + 90 * math.sqrt(share) * np.sin(rows)
    for picture in (waves, 255 - waves):
        found = BlockGrid(EVERYWHERE).extract(picture.round().astype(np.uint8)).texture
        assert ((found > 0.0) == corners).mean() > 0.9


def test_the_blocks_are_the_same_in_the_mirror():
    middles = BlockGrid(EVERYWHERE).centres
    assert middles.mean(axis=0) == pytest.approx(((SHAPE[1] - 1) / 2, (SHAPE[0] - 1) / 2))
    assert (middles.min(axis=0) > 0.0).all()


def test_blocks_that_do_not_count_are_left_out():
    counts = np.ones(SHAPE, np.bool_)
    counts[60:] = False
    grid = BlockGrid(counts)
    assert len(grid.centres) == 80
    assert grid.centres[:, 1].max() < 60


def test_learns_what_is_fixed_to_the_camera_and_forgets_it():
    grid, _ = measure(0.0, 0.0)
    everywhere = np.ones(len(grid.centres), np.bool_)
    fixed = grid.centres[:, 1] > 90
    for step in range(8):
        first, second = pair(SHAPE, 6.0, 0.0, seed=step)
        first[80:] = second[80:]
        shifts = grid.measure(grid.extract(first), second, expected=(6.0, 0.0))
        grid.learn(shifts, everywhere)
    assert grid.fixed[fixed].mean() > 0.9
    assert not grid.fixed[grid.centres[:, 1] < 60].any()
    shifts = grid.measure(grid.extract(first), second, expected=(6.0, 0.0))
    assert shifts.weight[grid.fixed].max() == 0.0
    for _ in range(8):
        grid.learn(measure(6.0, 0.0, grid=grid)[1], everywhere)
    assert not grid.fixed.any()


def test_what_may_rest_is_not_taken_to_be_fixed():
    grid, shifts = measure(0.0, 0.0)
    for _ in range(20):
        grid.learn(shifts, np.zeros(len(grid.centres), np.bool_))
    assert not grid.fixed.any()
    for _ in range(20):
        grid.learn(shifts, np.ones(len(grid.centres), np.bool_))
    assert grid.fixed.all()
    grid.forget()
    assert not grid.fixed.any()


def test_a_block_of_noise_is_less_precise_however_strong_its_texture():
    """The right half shows the scene with the same noise."""
    rng = np.random.default_rng(3)
    pictures = []
    for each in pair(SHAPE, 2.0, 0.0):
        noisy = np.where(np.arange(SHAPE[1]) < 180, 128.0, each) + rng.normal(0.0, 15.0, SHAPE)
        pictures.append(np.clip(noisy, 0, 255).astype(np.uint8))
    grid = BlockGrid(EVERYWHERE)
    shifts = grid.measure(grid.extract(pictures[0]), pictures[1], expected=(2.0, 0.0))
    noise, scene = grid.centres[:, 0] < 160, grid.centres[:, 0] > 210
    assert np.median(shifts.weight[noise]) == 1.0
    assert np.median(shifts.precision[noise]) < 0.6 * np.median(shifts.precision[scene])
    _, clear = measure(2.0, 0.0, grid=grid)
    assert np.median(clear.precision) > 0.9


@pytest.mark.parametrize(('contrast', 'sigma'), [(1.0, 4.0), (1.0, 20.0), (0.3, 10.0)])
def test_noise_moves_blocks_by_as_much_as_their_precision_says(contrast, sigma):
    errors = []
    for seed in range(4):
        rng, grid = np.random.default_rng(seed), BlockGrid(EVERYWHERE)
        first, second = (
            np.clip(contrast * each + rng.normal(50.0, sigma, SHAPE), 0, 255).astype(np.uint8)
            for each in pair(SHAPE, 2.0, 0.0))
        shifts = grid.measure(grid.extract(first), second, expected=(2.0, 0.0))
        # The precision 1 / (1 + v) belongs to a variance of v, in units of that without noise.
        seen = (shifts.weight > 0.0) & (shifts.precision > 0.2)
        variance = TUNING.block_deviation_px ** 2 * (1.0 / shifts.precision[seen] - 1.0)
        errors += list(np.square(shifts.dx[seen] - 2.0) / variance)
        errors += list(np.square(shifts.dy[seen]) / variance)
    assert len(errors) > 800
    # The median, as a block without a match may be anywhere. That of a chi-square is 0.45.
    assert 0.25 < np.median(errors) < 1.1


def test_blocks_count_between_a_blurred_picture_and_a_sharp_one():
    """They differ by more than the texture of the blurred one, and its texture is not noise."""
    first, second = pair(SHAPE, 2.0, 0.0)
    grid = BlockGrid(EVERYWHERE)
    shifts = grid.measure(grid.extract(cv2.blur(first, (15, 1))), second, expected=(2.0, 0.0))
    seen = shifts.weight > 0.5
    assert np.count_nonzero(seen) > 40
    assert shifts.precision[seen].min() > 0.0


def test_in_a_scene_that_grows_a_block_moves_as_a_point_beside_its_centre():
    """Least squares find the displacement of that point, whatever the direction of the edges."""
    height, width = 160, 640
    noise = np.random.default_rng(3).normal(size=(height, width)).astype(np.float32)
    texture = cv2.GaussianBlur(noise, (0, 0), 4.0)
    before = np.clip(128 + 40 * texture / texture.std(), 0, 255).astype(np.float32)
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    zoom = cv2.getRotationMatrix2D(middle.tolist(), 0.0, 1.06)
    after = cv2.warpAffine(before, zoom, (width, height), flags=cv2.INTER_CUBIC)
    grid = BlockGrid(np.ones((height, width), np.bool_))
    picture = grid.extract(before.round().astype(np.uint8))
    centres = grid.centres - middle
    shifts = grid.measure(
        picture, after.round().clip(0, 255).astype(np.uint8), expected=0.06 * centres)
    found = np.stack([shifts.dx, shifts.dy], axis=1)
    beside = centres + np.stack([picture.aside, picture.down], axis=1)
    inside = (shifts.weight > 0.0) & (np.abs(1.1 * centres) < middle - 8).all(axis=1)
    at_centre, at_point = (
        np.median(np.abs(found - 0.06 * place)[inside]) for place in (centres, beside))
    assert np.count_nonzero(inside) > 60
    assert at_point < 0.5 * at_centre


def test_the_displacement_of_a_block_is_that_of_its_texture():
    # A road that slides: each row moves in proportion to its distance from the horizon. The
    # texture of many blocks lies mostly at one of their sides.
    rng = np.random.default_rng(8)
    rows, columns = np.indices((160, 320), np.float32)
    noise = cv2.GaussianBlur(rng.normal(size=rows.shape).astype(np.float32), (0, 0), 1.2)
    strength = cv2.GaussianBlur(rng.normal(size=rows.shape).astype(np.float32), (0, 0), 4.0)
    road = 128 + 1000 * noise * np.clip(strength * 10, 0, 1)
    before = np.clip(road, 0, 255).astype(np.uint8)
    after = cv2.remap(before, columns, rows / 1.06, cv2.INTER_CUBIC)
    grid = BlockGrid(np.ones_like(before, np.bool_))
    picture = grid.extract(before)
    shifts = grid.measure(picture, after, expected=(0.0, 5.0))
    row, seen = grid.centres[:, 1], shifts.weight > 0.0
    seen &= (np.hypot(picture.aside, picture.down) > 1.0) & (row < 140)
    at_centre, at_texture = (
        np.median(np.abs(shifts.dy - 0.06 * place)[seen]) for place in (row, row + picture.down))
    assert np.count_nonzero(seen) > 30
    assert at_texture < 0.7 * at_centre
