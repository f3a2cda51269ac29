# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What cannot be measured, or wrongly, injected over real DDS."""

from coded import codes, complete, send
import cv2
import numpy as np
import pytest
from test_node import rolled

VEHICLE = {
    'max_gap': 1.0, 'still_time': 0.5, 'shift.min_significance': 6.0,
    'shift.look_past_zero': True, 'shift.confirm_frames': 2, 'shift.release_frames': 4}


def street(seed=0):
    """Return a picture with detail of all sizes, as a street has."""
    rng = np.random.default_rng(seed)
    return sum(
        cv2.resize(rng.normal(0, 1, (120 // size, 320 // size)), (320, 120)) * size
        for size in (1, 2, 4, 8, 20)) * 6 + 120


def seen(picture, rng, noise=2.0):
    """Return a frame of a picture as a sensor sees it."""
    return np.clip(picture + rng.normal(0, noise, picture.shape), 0, 255).astype(np.uint8)


def test_unrelated_images_are_no_measurement(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    send(node, [seen(street(seed), rng) for seed in range(8)], np.arange(8) * 0.1)
    shared_live.until(lambda: complete(node, 7))
    assert codes(node) == ([3] * 7, ['no_measurement'] * 7)


def test_standing_still_is_not_driving(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    send(node, [seen(street(), rng, noise=5.0) for _ in range(20)], np.arange(20) * 0.1)
    shared_live.until(lambda: complete(node, 19))
    movement, status = codes(node)
    # It takes some pairs to tell.
    assert status[5:] == ['still'] * 14
    assert movement[5:] == [3] * 14


def test_wrong_pairs_in_mid_turn_do_not_count_a_second_turn(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    positions = [0, 2, 4, 30, 60, 90, 120, 150, 180, 182, 184, 186, 188, 190]
    frames = [seen(np.roll(street(), position, axis=1), rng) for position in positions]
    # Two images of something else make three pairs in a row wrong.
    frames[5] = seen(np.roll(street(), 62, axis=1), rng)
    frames[6] = seen(np.roll(street(), 64, axis=1), rng)
    send(node, frames, np.arange(len(frames)) * 0.1)
    shared_live.until(lambda: complete(node, len(frames) - 1))
    movement, _ = codes(node)
    assert movement.count(0) == 1
    assert movement.count(2) == 0
    assert movement[-2:] == [1, 1]


def test_a_swerve_of_one_pair_is_no_turn(shared_live, tuned):
    rng = np.random.default_rng(0)
    node = tuned(VEHICLE)
    positions = [0, 2, 4, 30, 32, 34, 36]
    send(node, [seen(np.roll(street(), each, axis=1), rng) for each in positions],
         np.arange(7) * 0.1)
    shared_live.until(lambda: complete(node, 6))
    assert codes(node)[0] == [1, 1, 3, 1, 1, 1]


def test_a_mask_hides_what_never_moves(live, run, tmp_path):
    rng = np.random.default_rng(0)
    mask = np.full((120, 320), 255, np.uint8)
    mask[60:] = 0
    cv2.imwrite(str(tmp_path / 'mask.png'), mask)
    bonnet = street(9)[60:]
    node = run('-p', f'mask_file:={tmp_path / "mask.png"}')
    for index in range(5):
        picture = np.roll(street(), 20 * index, axis=1)
        picture[60:] = bonnet * 1.5
        send(node, [seen(picture, rng)], [index * 0.1])
    live.until(lambda: complete(node, 4))
    assert [each.vector.x for each in node['shift']] == pytest.approx([20] * 4, abs=0.3)


def test_a_mask_that_cannot_be_read_is_said_at_once(live):
    process = live.start('-p', 'mask_file:=/does/not/exist.png')
    assert process.wait() == 2
    assert 'mask_file: /does/not/exist.png cannot be read' in live.logs()


def test_a_threshold_that_does_not_fit_is_hinted_at_once(live, run):
    node = run()
    places = np.cumsum([0] * 5 + [14] * 30 + [0] * 90)
    send(node, rolled(places), np.arange(len(places)) * 0.1)
    live.until(lambda: complete(node, len(places) - 1))
    live.until_said(
        'no lasting shift reached the threshold of 16 px',
        'try code_source auto, or a threshold of about 7 px')
    assert live.logs().count('no lasting shift') == 1
