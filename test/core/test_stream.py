# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames as they come, and what the stream makes of them."""

from dataclasses import dataclass, replace

import numpy as np
from phase_traj_ros.core import (
    FrameStream,
    Measured,
    Movement,
    Restarted,
    Skipped,
    Started,
    TrajectoryEstimator,
)
from phase_traj_ros.core.reliability.reason import Reason
import pytest
from textures import pair

STEP_NS = 100_000_000
EPOCH_NS = 1_700_000_000 * 10**9
FRAME, TURNED = pair((64, 120), 30, 0)
TINY = np.zeros((4, 4), np.uint8)


@dataclass(frozen=True, eq=False)
class Given:
    """A frame with a stamp."""

    image: np.ndarray
    stamp_ns: int
    encoding: str = ''


def run(frames):
    """Return what came of the frames, and the estimator."""
    estimator = TrajectoryEstimator()
    stream = FrameStream(estimator)
    found = [outcome for frame in frames for outcome in stream.push(frame)]
    return [*found, *stream.finish()], estimator


def drive(images, *, start_ns=0):
    """Return frames with the noise of a sensor: no picture is repeated."""
    rng = np.random.default_rng(0)
    return [
        Given(
            np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8),
            start_ns + index * STEP_NS)
        for index, image in enumerate(images)]


def kinds(outcomes):
    return [type(outcome) for outcome in outcomes]


def test_an_ordinary_stream():
    frames = drive([FRAME, FRAME, TURNED])
    found, estimator = run(frames)
    assert kinds(found) == [Started, Measured, Measured]
    assert [outcome.frame for outcome in found] == frames
    assert [outcome.update.step.movement for outcome in found[1:]] == [
        Movement.FORWARD, Movement.LEFT]
    counters = estimator.counters
    assert (counters.frames, counters.dropped, counters.skipped, counters.repeated) == (3, 0, 0, 0)


def test_late_stray_and_repeated_stamps_are_dropped_and_counted():
    frames = drive([FRAME] * 6, start_ns=EPOCH_NS)
    late, repeated, stray = (
        Given(TURNED, stamp) for stamp in (frames[2].stamp_ns - 1, frames[3].stamp_ns, 0))
    found, estimator = run([*frames[:3], late, frames[3], repeated, stray, *frames[4:]])
    assert [outcome.frame for outcome in found] == frames
    counters = estimator.counters
    assert (counters.dropped, counters.repeated, counters.time_resets) == (2, 1, 0)
    assert [int(code) for code in estimator.codes.movement] == [1] * 5


def test_a_loop_restarts_and_is_told_before_anything_is_forgotten():
    estimator = TrajectoryEstimator()
    stream = FrameStream(estimator)
    once = drive([FRAME] * 12 + [TURNED])
    for frame in once:
        list(stream.push(frame))
    known = len(estimator.codes.movement)
    assert list(stream.push(once[0])) == []
    outcomes = stream.push(once[1])
    assert next(outcomes) == Restarted(once[-1].stamp_ns, 0)
    assert len(estimator.codes.movement) == known
    assert kinds(outcomes) == [Started, Measured]
    assert (estimator.frames, estimator.path.corners[0].stamp_ns) == (2, 0)
    assert (estimator.counters.time_resets, estimator.counters.frames) == (1, 15)


def test_frames_that_cannot_be_used_are_skipped():
    frames = drive([FRAME, FRAME, FRAME])
    found, estimator = run([frames[0], Given(TINY, frames[1].stamp_ns), frames[2]])
    assert kinds(found) == [Started, Skipped, Measured]
    assert '4x4' in found[1].reason
    assert found[2].update.interval_ns == 2 * STEP_NS
    assert estimator.counters.skipped == 1


def test_frames_that_cannot_be_used_to_the_end_are_lost():
    frames = drive([FRAME] * 40)
    lost = [Given(TINY, frame.stamp_ns) for frame in frames]
    _, estimator = run([*frames[:20], *lost[20:28], *frames[28:]])
    assert estimator.reliability.reliable
    _, estimator = run([*frames[:20], *lost[20:]])
    for verdict in (estimator.reliability, estimator.reliability.of_drive):
        assert verdict.words == ('frames_lost',)
        assert (verdict.end_ns - verdict.start_ns) == 39 * STEP_NS
        [span] = verdict.spans
        assert (span.start_ns, span.end_ns) == (frames[19].stamp_ns, frames[-1].stamp_ns)


def test_a_restart_with_a_frame_that_cannot_be_used():
    frames = drive([FRAME] * 13)
    found, estimator = run([*frames, Given(TINY, 0), *frames[1:3]])
    assert kinds(found[-4:]) == [Restarted, Skipped, Started, Measured]
    assert estimator.frames == 2


def test_a_frame_after_a_gap_is_used_at_the_end():
    frames = [*drive([FRAME, FRAME]), Given(FRAME, 10**10)]
    estimator = TrajectoryEstimator()
    stream = FrameStream(estimator)
    assert [len(list(stream.push(frame))) for frame in frames] == [1, 1, 0]
    [last] = stream.finish()
    assert last.frame is frames[2]


def test_after_a_reset_any_stamp_starts_anew():
    estimator = TrajectoryEstimator()
    stream = FrameStream(estimator)
    frames = drive([FRAME, FRAME])
    for frame in frames:
        list(stream.push(frame))
    stream.reset()
    assert kinds(stream.push(frames[0])) == [Started]
    assert estimator.frames == 1
    stream.skip()
    assert estimator.counters.skipped == 1


@pytest.mark.parametrize('stamp_ns', [EPOCH_NS + 19 * STEP_NS, 0], ids=['the_last', 'zero'])
def test_a_camera_that_stops_stamping_is_said_and_unreliable(stamp_ns):
    moving = [np.roll(FRAME, index, axis=1) for index in range(50)]
    frames = drive(moving, start_ns=EPOCH_NS)
    stuck = [replace(frame, stamp_ns=stamp_ns) for frame in frames[20:]]
    _, before = run(frames[:20])
    _, briefly = run([*frames[:20], *stuck[:5], *frames[25:]])
    _, after = run([*frames[:20], *stuck])
    assert Reason.FROZEN not in (*before.reliability.reasons, *briefly.reliability.reasons)
    assert Reason.FROZEN in after.reliability.reasons
    assert Reason.FROZEN in after.reliability.of_drive.reasons
    assert len(after.codes.movement) == 19
