# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements of the blocks of an image."""

import tracemalloc

import cv2
from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.core import Shift
from phase_traj_ros.core.correlation.block_motion import BlockMotion
import pytest
from textures import pair

SHAPE = (240, 320)


def soft(shape, dx, dy, *, seed=0, dtype=np.uint8):
    """Return a pair of frames without fine detail, which would alias when reduced."""
    return tuple(
        cv2.GaussianBlur(frame, (0, 0), 4.0).astype(dtype) for frame in pair(
            shape, dx, dy, seed=seed, dtype=dtype))


def watched(*frames, **options):
    blocks = BlockMotion(**options)
    for frame in frames:
        has_pair = blocks.update(frame)
    assert has_pair
    return blocks


@pytest.mark.parametrize('shape', [(120, 160), SHAPE, (241, 323), (480, 640)], ids=str)
@pytest.mark.parametrize(('dx', 'dy'), [(0.0, 0.0), (0.3, -0.1), (-1.0, 0.6), (0.02, 0.05)])
def test_blocks_follow_a_small_shift(shape, dx, dy):
    flow = watched(*soft(shape, dx, dy)).flow()
    # Reducing the frame flattens gradients by up to a third.
    size = np.hypot(dx, dy)
    error = np.hypot(*(np.median(flow.vectors[flow.textured], axis=0) - (dx, dy)))
    assert error <= 0.35 * size + 0.01
    assert flow.textured.mean() > 0.8


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16, np.float32])
def test_every_type_gives_the_same(dtype):
    flow = watched(*soft(SHAPE, 0.5, -0.2, dtype=dtype)).flow()
    expected = watched(*soft(SHAPE, 0.5, -0.2)).flow()
    np.testing.assert_allclose(
        np.median(flow.vectors, axis=0), np.median(expected.vectors, axis=0), atol=0.02)


def test_brightness_and_contrast_do_not_matter():
    first, second = soft(SHAPE, 0.5, -0.2, dtype=np.float32)
    flow = watched(first, second * 0.6 + 40).flow()
    plain = watched(first, second).flow()
    assert np.median(np.abs(flow.vectors - plain.vectors)) < 0.03


def test_the_scale_of_the_values_does_not_matter():
    first, second = soft(SHAPE, 0.5, -0.2, dtype=np.float32)
    flow, plain = watched(first * 1e-4, second * 1e-4).flow(), watched(first, second).flow()
    np.testing.assert_allclose(flow.vectors, plain.vectors, rtol=1e-3, atol=1e-3)
    np.testing.assert_array_equal(flow.textured, plain.textured)


def test_zooming_moves_blocks_away_from_the_middle():
    first, _ = soft(SHAPE, 0, 0)
    grow = cv2.getRotationMatrix2D((159.5, 119.5), 0.0, 1.01)
    second = cv2.warpAffine(first, grow, SHAPE[::-1], flags=cv2.INTER_CUBIC)
    vectors = watched(first, second).flow().vectors.reshape(4, 8, 2)
    assert (vectors[:, :3, 0] < 0).all() and (vectors[:, 5:, 0] > 0).all()
    assert (vectors[0, :, 1] < 0).all() and (vectors[-1, :, 1] > 0).all()


def test_a_part_without_texture_does_not_count():
    first, second = soft(SHAPE, 0.4, 0)
    for frame in (first, second):
        frame[:120] = 20
    textured = watched(first, second).flow().textured.reshape(4, 8)
    assert not textured[0].any()
    assert textured[-1].all()


@pytest.mark.parametrize('value', [0, 255])
def test_constant_frames_have_no_texture_and_follow_nothing(value):
    constant = np.full(SHAPE, value, np.uint8)
    blocks = watched(constant, constant)
    flow = blocks.flow()
    assert not flow.textured.any()
    assert np.isfinite(flow.vectors).all()
    assert blocks.share_following(Shift(20, 3, 0.1)) == 0.0


@pytest.mark.parametrize(('dx', 'dy'), [(20.0, 0.0), (-75.0, 5.0), (4.0, -9.0)])
def test_a_picture_follows_the_shift_it_has_made(dx, dy):
    moved, held = watched(*pair(SHAPE, dx, dy)), watched(*pair(SHAPE, 0, 0))
    assert moved.share_following(Shift(dx, dy, 0.1)) == 1.0
    assert held.share_following(Shift(dx, dy, 0.1)) == 0.0


def test_the_share_is_that_of_the_picture():
    first, second = pair(SHAPE, 24, 0)
    second[:, :160] = first[:, :160]
    share = watched(first, second).share_following(Shift(24, 0, 0.1))
    assert share == pytest.approx(0.5, abs=0.15)


def test_the_level_of_the_values_does_not_matter():
    first, second = pair(SHAPE, 24, 0, dtype=np.float32)
    blocks = watched(first / first.std() + 1e4, second / first.std() + 1e4)
    assert blocks.share_following(Shift(24, 0, 0.1)) == 1.0
    assert blocks.flow().textured.mean() > 0.8


def test_bright_areas_without_texture_do_not_count():
    first, second = pair(SHAPE, 24, 0)
    for frame in (first, second):
        frame[:120] = 250
    assert watched(first, second).share_following(Shift(24, 0, 0.1)) == 1.0


def test_a_shift_out_of_the_frame_is_followed_by_nothing():
    assert watched(*pair(SHAPE, 0, 0)).share_following(Shift(500, 0, 0.1)) == 0.0


def test_queries_change_nothing():
    blocks = watched(*soft(SHAPE, 0.3, 0.1))
    before = blocks.flow()
    share = blocks.share_following(Shift(20, 0, 0.1))
    np.testing.assert_array_equal(blocks.flow().vectors, before.vectors)
    assert blocks.share_following(Shift(20, 0, 0.1)) == share


def test_masked_blocks_do_not_count():
    mask = np.ones(SHAPE, np.uint8)
    mask[:, :160] = 0
    first, second = pair(SHAPE, 24, 0)
    second[:, :160] = first[:, :160]
    blocks = watched(first, second, mask=mask)
    assert blocks.share_following(Shift(24, 0, 0.1)) == 1.0
    textured = blocks.flow().textured.reshape(4, 8)
    assert not textured[:, :4].any() and textured[:, 4:].all()


def test_there_is_a_pair_from_the_second_frame_on():
    frame, _ = pair(SHAPE, 0, 0)
    blocks = BlockMotion()
    assert [blocks.update(frame) for _ in range(3)] == [False, True, True]
    for other in (frame[:-1], frame[:-1].astype(np.float32)):
        assert [blocks.update(other) for _ in range(2)] == [False, True]


def test_nothing_of_a_frames_size_is_allocated_in_the_long_run():
    frames = pair((376, 1241), 5, 0)
    blocks = watched(*frames)
    blocks.flow()
    tracemalloc.start()
    try:
        for frame in frames:
            blocks.update(frame)
            blocks.flow()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 376 * 1241


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(8, 70), st.integers(8, 400)), flip=st.booleans(),
    seed=st.integers(0, 999), dtype=st.sampled_from([np.uint8, np.uint16, np.float32]))
def test_any_frames_of_any_size_give_finite_vectors(shape, flip, seed, dtype):
    rng = np.random.default_rng(seed)
    frames = rng.integers(0, 256, (2, *(shape[::-1] if flip else shape))).astype(dtype)
    blocks = watched(*frames)
    flow = blocks.flow()
    assert np.isfinite(flow.vectors).all()
    assert len(flow.vectors) == len(flow.textured) >= 1
    assert 0.0 <= blocks.share_following(Shift(2.0, 1.0, 0.1)) <= 1.0
