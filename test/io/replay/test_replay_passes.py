# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One pass, as in the node, and two passes if the camera is not known."""

import json
import math
from pathlib import Path
import threading

import cv2
from far_scene import render
import numpy as np
from phase_traj_ros.core import LensOrigin
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.replay.camera import learned_lens
from phase_traj_ros.io.replay.run import Watcher
from phase_traj_ros.io.sources.base import Candidate, FrameSource, StampedFrame
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import EVERYTHING
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest
from phase_traj_ros.tasks.batch.outcome import run_request
import pytest

WIDE = CameraModel.pinhole((160, 320), 110.0)
YAWS = (0, *[0] * 8, *[-6] * 15, *[0] * 12, *[6] * 15, *[0] * 12)
FIRST, SECOND = 'pass 1 of 2: learning the camera', 'pass 2 of 2'


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder of pictures of a wide camera: a turn to the right, one to the left."""
    path = tmp_path_factory.mktemp('wide')
    for index, heading in enumerate(np.cumsum(YAWS)):
        picture = render(WIDE, np.tan, math.radians(heading))
        cv2.imwrite(str(path / f'{index:03}.png'), picture)
    return path


class Seen(Watcher):
    """Counts frames and pairs."""

    def __init__(self):
        self.starts, self.pairs = 0, 0

    def start(self, frame, estimator):
        self.starts += 1

    def add(self, frame, update, estimator):
        self.pairs += 1


def replayed(folder, *, one_pass, through=lambda frames, which: frames, **values):
    seen = Seen()
    with open_source(folder) as source:
        result = replay_source(
            source, ReplayRequest(
                source=folder, parameters=Parameters(**values), one_pass=one_pass),
            watchers=[seen], through=through)
    assert (seen.starts, seen.pairs) == (1, len(YAWS) - 1)
    return result


def codes(result):
    return [
        (update.step, update.status, update.shift, update.heading, update.tip)
        for update in result.updates]


def changes(result):
    return [int(code) for code in result.movement if code in (0, 2)]


@pytest.mark.parametrize(('values', 'expected'), [
    ({'focal_px': 110.0}, [2, 0]), ({'hfov_deg': 111.0, 'lens_straightness': 0.9}, [2, 0]),
    ({'code_source': 'heading', 'focal_px': 110.0}, [2, 0]),
    # In a turn, the picture shifts by 12 pixels.
    ({'threshold': 8.0}, [2, 0]), ({'code_source': 'shift'}, [])])
def test_what_is_known_takes_one_pass(folder, values, expected):
    passes = []

    def counted(frames, which):
        passes.append(which)
        return frames

    plain = replayed(folder, one_pass=False, through=counted, **values)
    assert passes == ['']
    assert codes(plain) == codes(replayed(folder, one_pass=True, **values))
    assert changes(plain) == expected


def test_the_passes_are_told_apart(folder):
    passes = []

    def counted(frames, which):
        frames = list(frames)
        passes.append((which, len(frames)))
        return frames

    replayed(folder, one_pass=False, through=counted)
    assert passes == [(FIRST, len(YAWS)), (SECOND, len(YAWS))]


def test_learning_ends_where_the_camera_is_known_well(folder, monkeypatch):
    monkeypatch.setattr('phase_traj_ros.io.replay.camera._ENOUGH_TURNS', 1)
    taken = dict.fromkeys((FIRST, SECOND), 0)

    def counted(frames, which):
        for frame in frames:
            taken[which] += 1
            yield frame

    result = replayed(folder, one_pass=False, through=counted)
    # The first turn ends at frame 24, the second one at frame 51.
    assert 20 <= taken[FIRST] < 51
    assert taken[SECOND] == len(YAWS)
    assert result.camera.turns == 1
    assert changes(result) == [2, 0]


def test_learning_ends_although_the_camera_in_use_stays(monkeypatch):
    monkeypatch.setattr('phase_traj_ros.io.replay.camera._ENOUGH_TURNS', 3)
    taken = []

    def driven():
        for index, heading in enumerate(np.cumsum(YAWS * 3)):
            taken.append(index)
            picture = render(WIDE, np.tan, math.radians(heading))
            yield StampedFrame(picture, index * 100_000_000)

    # The later turns agree with the first ones, so no better camera comes into use.
    lens = learned_lens(driven(), Parameters(), 'film')
    assert lens.estimate.turns == 3
    assert len(taken) <= 2 * len(YAWS)


def test_the_second_pass_codes_with_what_the_first_has_learned(folder):
    one, two = (replayed(folder, one_pass=flag) for flag in (True, False))
    assert changes(one) == changes(two) == [2, 0]
    assert [each.camera.origin for each in (one, two)] == [LensOrigin.DRIVE] * 2
    assert two.camera.focal_px == pytest.approx(WIDE.fx, rel=0.1)
    # The estimate that is left at the end of the first is in use from the start of the second.
    told = [update.camera for update in two.updates if update.camera is not None]
    assert told == [two.camera]
    assert two.camera.turns == one.learned.turns
    assert two.updates[0].camera == two.camera
    assert one.updates[0].camera.origin is LensOrigin.ASSUMED
    # So the first turn is coded while it is driven, and not only after it.
    first = [result.movement.index(2) for result in (one, two)]
    assert first[1] < 9 + 15 and first[1] < first[0]


def test_a_pass_for_learning_writes_nothing_and_is_counted_as_progress(folder, tmp_path):
    for one_pass, passes in ((False, 2), (True, 1)):
        done = []
        job = ReplayRequest(
            source=folder, output=tmp_path / f'of {passes}', one_pass=one_pass)
        outcome = run_request(job, lambda number, total, done=done: done.append((number, total)))
        assert (outcome.turns, outcome.frames) == (2, len(YAWS)), outcome
        assert done == [(index, passes * len(YAWS)) for index in range(passes * len(YAWS))]
        content = json.loads((job.output / 'chain_code.json').read_text())
        assert len(content['movement']) == len(YAWS) - 1
        assert content['camera']['origin'] == 'drive'


def test_a_camera_that_the_source_gives_is_counted_as_one_pass(folder, tmp_path):
    (tmp_path / 'image_0').symlink_to(folder)
    (tmp_path / 'calib.txt').write_text(
        'P0: 112.0 0.0 159.5 0.0 0.0 112.0 79.5 0.0 0.0 0.0 1.0 0.0\n')
    done = []
    outcome = run_request(
        ReplayRequest(source=tmp_path / 'image_0'), lambda *progress: done.append(progress))
    assert outcome.error == ''
    assert done == [(index, len(YAWS)) for index in range(len(YAWS))]


class _Counted(FrameSource):
    """Yields frames of noise, and counts how often they are read; some are invalid."""

    def __init__(self, *, unusable):
        super().__init__(description='noise', selection=EVERYTHING, frame_count=20)
        self.passes = 0
        self._unusable = unusable

    def _candidates(self):
        self.passes += 1
        rng = np.random.default_rng(0)
        for number in range(20):
            image = rng.integers(0, 255, (60, 90), np.uint8)
            if (self.passes, number) == self._unusable:
                image = np.zeros((0, 0), np.uint8)
            yield Candidate(number, number * 100_000_000, lambda image=image: image)


@pytest.mark.parametrize('number_of_pass', [1, 2])
def test_a_pass_that_fails_leaves_no_thread_that_reads(number_of_pass):
    source = _Counted(unusable=(number_of_pass, 5))
    with pytest.raises(SourceError, match='frame 5') as failure:
        replay_source(source, ReplayRequest(
            source=Path('noise'), parameters=Parameters(code_source='auto'),
            strict=True))
    assert source.passes == number_of_pass
    # The error refers to the running generator: the garbage collector would come too late.
    assert failure.tb is not None
    assert all(thread.name != 'prefetch' for thread in threading.enumerate())
