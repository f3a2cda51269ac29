# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The offline replay."""

from functools import lru_cache

import numpy as np
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.replay.run import replay, Watcher
from phase_traj_ros.io.sources.base import StampedFrame, UnreadableFrame
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest

RNG = np.random.default_rng(0)
TEXTURE = RNG.integers(0, 256, (64, 100), dtype=np.uint8)


def frames(positions, start=0):
    return [
        StampedFrame(
            sensor_noise(np.roll(TEXTURE, position, axis=1), sigma=1.0, seed=index),
            start + index * 10**8)
        for index, position in enumerate(positions)]


def test_codes_and_updates_agree():
    result = replay(frames([0, 0, 30, 30]), Parameters(threshold=16.0), source='test')
    assert result.frames == 4
    assert result.movement == [1, 0, 1] == list(result.codes.movement)
    assert result.direction == [1, 0, 0] == list(result.codes.direction)


def test_after_time_goes_back_only_what_follows_counts():
    result = replay(
        frames([0, 0, 30, 30], start=10**10) + frames([0, 30]), Parameters(threshold=16.0),
        source='test')
    assert (result.frames, result.first_stamp_ns) == (2, 0)
    assert result.movement == list(result.codes.movement) == [1]
    assert result.counters.time_resets == 1


def test_repeated_stamps_are_dropped():
    doubled = [frame for frame in frames([0, 0, 30]) for _ in range(2)]
    result = replay(doubled, Parameters(threshold=16.0), source='test')
    assert (result.frames, result.movement) == (3, [1, 0])
    assert result.counters.repeated == 3


class Diary(Watcher):
    """Records the calls of a watcher."""

    def __init__(self):
        self.told = []

    def start(self, frame, estimator):
        self.told.append(('start', frame.stamp_ns))

    def add(self, frame, update, estimator):
        self.told.append((update.pair, frame.stamp_ns))


def test_watchers_are_started_once_whatever_frames_are_repeated():
    doubled = [frame for frame in frames([0, 0, 30]) for _ in range(3)]
    diary = Diary()
    replay(doubled, Parameters(threshold=16.0), source='test', watchers=[diary])
    assert diary.told == [('start', 0), (0, 10**8), (1, 2 * 10**8)]


def test_watchers_restart_when_time_goes_back():
    diary = Diary()
    replay(
        frames([0, 0], start=10**10) + frames([0, 30]), Parameters(threshold=16.0), source='test',
        watchers=[diary])
    assert diary.told == [
        ('start', 10**10), (0, 10**10 + 10**8), ('start', 0), (0, 10**8)]


@pytest.mark.parametrize('some', [[], frames([0]), frames([0]) * 5])
def test_two_frames_are_needed(some):
    with pytest.raises(SourceError, match='at least two'):
        replay(some, Parameters(threshold=16.0), source='test')


def with_bad_ones():
    """Return frames 0 to 5, of which 2 and 4 cannot be used."""
    good = [
        StampedFrame(frame.image, frame.stamp_ns, number=number)
        for number, frame in enumerate(frames([0, 0, 30, 30, 60, 60]))]
    tiny = StampedFrame(np.zeros((4, 4), np.uint8), good[2].stamp_ns, number=2)
    return [*good[:2], tiny, good[3], UnreadableFrame(4, good[4].stamp_ns, 'cut off'), good[5]]


def test_unusable_frames_are_skipped_and_counted():
    result = replay(with_bad_ones(), Parameters(threshold=16.0), source='test')
    assert (result.movement, list(result.frame_numbers)) == ([1, 0, 3], [0, 1, 3, 5])
    assert (result.counters.skipped, result.counters.frames) == (2, 4)
    assert result.first_skipped.startswith('frame 2: ') and '4x4' in result.first_skipped


def test_strict_names_the_unusable_frame():
    with pytest.raises(SourceError, match=r'test: frame 2: .*4x4'):
        replay(with_bad_ones(), Parameters(threshold=16.0), source='test', strict=True)
    unreadable = [frame for frame in with_bad_ones() if frame.number != 2]
    with pytest.raises(SourceError, match=r'test: frame 4: cut off'):
        replay(unreadable, Parameters(threshold=16.0), source='test', strict=True)


def test_what_became_of_the_frames_is_said_if_too_few_are_left():
    bad = [UnreadableFrame(number, number * 10**8, 'cut off') for number in range(3)]
    with pytest.raises(SourceError, match=r'1 frame to use, 3 skipped \(frame 0: cut off\), but'):
        replay([*bad, *frames([0])], Parameters(threshold=16.0), source='test')


def swapped(some, at):
    return [*some[:at], some[at + 1], some[at], *some[at + 2:]]


@pytest.mark.parametrize('at', [6, 18])
def test_two_swapped_frames_cost_one(at):
    drive = frames([0] * 10 + [30] * 10)
    result = replay(swapped(drive, at), Parameters(threshold=16.0), source='test')
    assert (result.frames, result.movement.count(0)) == (19, 1)
    assert (result.counters.dropped, result.counters.time_resets) == (1, 0)


@pytest.mark.parametrize('bad_ns', [0, 1_700_003_600 * 10**9, 1_600_000_000 * 10**9])
def test_a_bad_stamp_in_mid_stream_costs_its_frame(bad_ns):
    drive = frames([0] * 10 + [30] * 10, start=1_700_000_000 * 10**9)
    stray = StampedFrame(drive[8].image, bad_ns)
    result = replay([*drive[:8], stray, *drive[9:]], Parameters(threshold=16.0), source='test')
    assert (result.frames, result.first_stamp_ns) == (19, drive[0].stamp_ns)
    assert (result.counters.dropped, result.counters.time_resets) == (1, 0)


@pytest.mark.parametrize('threshold', [16.0, 20.0])
def test_real_driving_around_two_corners(kitti_root, threshold):
    result = replayed(kitti_root / '00', threshold)
    # A right turn, then a left turn that has begun when the clip ends.
    assert [run.code for run in result.codes.movement.runs] == [1, 2, 3, 1, 0, 3]
    assert [run.code for run in result.codes.direction.runs] == [1, 2, 1]
    begin = result.movement.index(2)
    assert 90 <= begin <= 110
    assert 180 <= result.movement.index(0) <= 198


def test_real_driving_straight_on(kitti_root):
    assert replayed(kitti_root / '06', 20.0).movement == [1] * 50


def test_real_driving_seen_in_a_mirror(kitti_root):
    result = replayed(kitti_root / '00', 20.0)
    with open_source(kitti_root / '00') as source:
        mirrored = replay(
            (StampedFrame(np.ascontiguousarray(frame.image[:, ::-1]), frame.stamp_ns)
             for frame in source),
            result.parameters, source='mirror')
    mirror = {0: 2, 1: 1, 2: 0, 3: 3}
    assert mirrored.movement == [mirror[code] for code in result.movement]
    assert mirrored.direction == [mirror[code] for code in result.direction]


@lru_cache(maxsize=2)
def replayed(path, threshold):
    parameters = Parameters().with_values({'threshold': threshold})
    with open_source(path) as source:
        return replay(source, parameters, source=source.description)
