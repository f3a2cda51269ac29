# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Two passes over the frames of a source: the frames kept between them, and threads."""

from functools import partial
from pathlib import Path
import threading

import numpy as np
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.replay.kept import KeptFrames
from phase_traj_ros.io.sources.base import Candidate, FrameSource
from phase_traj_ros.io.sources.selection import EVERYTHING
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch.job import replay_source
from phase_traj_ros.tasks.batch.request import ReplayRequest
import pytest

TENTH = 100_000_000


class _Counted(FrameSource):
    """Yields frames of noise, and counts how often they are read; some are invalid."""

    def __init__(self, *, unusable=(), frame_count=20):
        super().__init__(description='noise', selection=EVERYTHING, frame_count=frame_count)
        self.passes = 0
        self._unusable = unusable

    def _candidates(self):
        self.passes += 1
        rng = np.random.default_rng(0)
        for number in range(20):
            image = rng.integers(0, 255, (60, 90), np.uint8)
            if (self.passes, number) in self._unusable:
                image = np.zeros((0, 0), np.uint8)
            yield Candidate(number * TENTH, lambda image=image: image)


def no_thread_left():
    return all(thread.name != 'prefetch' for thread in threading.enumerate())


@pytest.mark.parametrize('frame_count', [20, 10, None])
@pytest.mark.parametrize(('most_bytes', 'passes'), [(20 * 60 * 90, 1), (20 * 60 * 90 - 1, 2)])
def test_what_fits_is_read_once(most_bytes, passes, frame_count):
    source = _Counted(frame_count=frame_count)
    kept = KeptFrames(source, most_bytes=most_bytes)
    first, second = list(kept.keeping()), list(kept.once())
    assert [frame.stamp_ns for frame in first] == [frame.stamp_ns for frame in second]
    assert all(np.array_equal(one.image, other.image) for one, other in zip(first, second))
    assert source.passes == passes
    # They are released: another pass reads them again.
    assert len(list(kept.once())) == 20
    assert source.passes == passes + 1


@pytest.mark.parametrize('number_of_pass', [1, 2])
def test_a_pass_that_fails_leaves_no_thread_that_reads(number_of_pass, monkeypatch):
    monkeypatch.setattr(
        'phase_traj_ros.tasks.batch.job.KeptFrames', partial(KeptFrames, most_bytes=0))
    source = _Counted(unusable=[(number_of_pass, 5)])
    with pytest.raises(SourceError, match='frame 5') as failure:
        replay_source(source, ReplayRequest(
            source=Path('noise'), parameters=Parameters(code_source='auto'),
            strict=True))
    assert source.passes == number_of_pass
    # The error refers to the running generator: the garbage collector would come too late.
    assert failure.tb is not None
    assert no_thread_left()
