# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Videos: frames, stamps, and files that are not videos."""

from itertools import pairwise

import cv2
from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io import open_source, Selection
from phase_traj_ros.io.sources.base import SourceFrames
from phase_traj_ros.io.sources.video import VideoClock
import pytest

TENTH = 100_000_000


@pytest.fixture(autouse=True)
def by_opencv(monkeypatch):
    """Read with OpenCV, whatever is installed."""
    monkeypatch.setattr('phase_traj_ros.io.sources.pyav_video.has_pyav', lambda: False)


@pytest.fixture
def video(tmp_path):
    """Return a video at 10 Hz of 8 frames, each brighter by 20 than the previous one."""
    path = tmp_path / 'video.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 10.0, (64, 48))
    assert writer.isOpened()
    for index in range(8):
        writer.write(np.full((48, 64, 3), 20 * index, np.uint8))
    writer.release()
    return path


def read(path, **options):
    """Return the stamps, and the indices of the frames derived from their brightness."""
    with open_source(path, **options) as source:
        frames = list(source)
    for frame in frames:
        assert frame.image.shape == (48, 64)
        assert frame.image.dtype == np.uint8
    return [frame.stamp_ns for frame in frames], [
        round(frame.image.mean() / 20) for frame in frames]


def test_frames_and_stamps(video):
    with open_source(video) as source:
        assert source.frame_count == 8
        assert 'video.avi (video, 10 frames per second)' in source.description
    assert read(video) == ([index * TENTH for index in range(8)], list(range(8)))


def test_given_rate_overrides_that_of_the_video(video):
    assert read(video, fps=4)[0] == [index * 250_000_000 for index in range(8)]


@pytest.mark.parametrize(('selection', 'expected'), [
    (Selection(every=3), [0, 3, 6]),
    (Selection(start=0.2), [2, 3, 4, 5, 6, 7]),
    (Selection(start=0.2, duration=0.3), [2, 3, 4]),
    (Selection(start=0.2, duration=0.4, every=2), [2, 4]),
])
def test_selection(video, selection, expected):
    assert read(video, selection=selection) == ([index * TENTH for index in expected], expected)
    assert open_source(video, selection=selection).frame_count == len(expected)


class FakeCapture:
    """
    A fake cv2.VideoCapture that returns given values.

    A frame that is None can be grabbed, but not decoded.
    """

    def __init__(self, frames, properties):
        self._frames = frames
        self._properties = properties
        self._index = -1

    def isOpened(self):
        return True

    def grab(self):
        self._index += 1
        return self._index < len(self._frames)

    def retrieve(self):
        frame = self._frames[self._index]
        return frame is not None, frame

    def read(self):
        return self.retrieve() if self.grab() else (False, None)

    def get(self, key):
        value = self._properties.get(key, 0.0)
        return value[self._index] if isinstance(value, list) else value

    def release(self):
        pass


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """Return the path of a fake video described by the arguments."""
    def make(frames, properties):
        monkeypatch.setattr(cv2, 'VideoCapture', lambda *_: FakeCapture(frames, properties))
        path = tmp_path / 'fake.avi'
        path.write_bytes(b'RIFF\x00\x00\x00\x00AVI ')
        return path
    return make


GREY = np.zeros((48, 64), np.uint8)


@pytest.mark.parametrize('fps', [0.0, -5.0, float('nan'), float('inf'), 90000.0])
def test_absurd_rate_of_the_container(fake, fps):
    path = fake([GREY] * 3, {cv2.CAP_PROP_FPS: fps})
    assert read(path)[0] == [0, TENTH, 2 * TENTH]
    assert '10 frames per second assumed' in open_source(path).description


@pytest.mark.parametrize('count', [0.0, -1.0, float('nan'), float('inf'), -9.2e18, 1e19])
def test_absurd_number_of_frames(fake, count):
    path = fake([GREY] * 3, {cv2.CAP_PROP_FPS: 10.0, cv2.CAP_PROP_FRAME_COUNT: count})
    assert open_source(path).frame_count is None
    assert len(read(path)[0]) == 3


def test_positions_count_where_they_increase(fake):
    path = fake([GREY] * 4, {
        cv2.CAP_PROP_FPS: 10.0, cv2.CAP_PROP_POS_MSEC: [0.0, 40.0, 100.5, 100.5]})
    assert read(path)[0] == [0, 40_000_000, 100_500_000, 200_500_000]
    assert read(path, fps=5)[0] == [0, 2 * TENTH, 4 * TENTH, 6 * TENTH]


def test_absurd_positions_do_not_count(fake):
    path = fake([GREY] * 5, {
        cv2.CAP_PROP_FPS: 10.0,
        cv2.CAP_PROP_POS_MSEC: [-1.0, float('nan'), float('inf'), 1e13, 1e300]})
    assert read(path)[0] == [index * TENTH for index in range(5)]


@given(
    st.lists(st.one_of(st.none(), st.integers(), st.integers(0, 10 ** 12)), max_size=30),
    st.floats(0.1, 1000))
def test_stamps_increase_whatever_the_positions(positions, fps):
    clock = VideoClock(fps)
    stamps = [clock.stamp_ns(position) for position in positions]
    assert all(later > earlier for earlier, later in pairwise(stamps))
    assert all(isinstance(stamp, int) for stamp in stamps)


def test_clock_without_positions():
    clock = VideoClock(30.0)
    assert [clock.stamp_ns(None) for _ in range(31)][-1] == 10 ** 9


def test_frame_that_cannot_be_decoded(fake):
    path = fake([GREY, GREY, None], {cv2.CAP_PROP_FPS: 10.0})
    with open_source(path) as source, pytest.raises(SourceError, match='frame 2 of the video'):
        list(source)
    # Unless it is not selected.
    assert len(read(path, selection=Selection(every=3))[0]) == 1


@pytest.mark.parametrize('frames', [[], [None]])
def test_no_frame(fake, frames):
    with pytest.raises(SourceError, match='no frame of the video'):
        open_source(fake(frames, {}))


@pytest.mark.parametrize('kept', [50, 1000])
def test_truncated_before_the_first_frame(video, kept):
    video.write_bytes(video.read_bytes()[:kept])
    with pytest.raises(SourceError, match=r'cannot be opened as a video|no frame') as caught:
        open_source(video)
    assert '\n' not in str(caught.value)


def test_colour_becomes_luma(tmp_path, picture):
    bgr = cv2.resize(picture(), (64, 48), interpolation=cv2.INTER_LINEAR)
    path = tmp_path / 'colour.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 10.0, (64, 48))
    writer.write(bgr)
    writer.release()
    with open_source(path) as source:
        (frame,) = source
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    assert np.abs(frame.image.astype(int) - grey).mean() < 5


@pytest.fixture
def raw(tmp_path):
    """Return a stream of JPEGs without a container."""
    path = tmp_path / 'raw.mjpeg'
    path.write_bytes(b''.join(
        cv2.imencode('.jpg', np.full((48, 64), 20 * index, np.uint8))[1].tobytes()
        for index in range(8)))
    return path


def test_the_rate_of_a_raw_stream_is_assumed(raw):
    with open_source(raw) as source:
        assert 'frames per second assumed' in source.description
        assert (len(list(source)), source.frames.declared) == (8, None)
    assert '12 frames per second)' in open_source(raw, fps=12).description


@pytest.mark.parametrize(('start', 'is_raw'), [
    (b'\x00\x00\x00\x01\x67', True), (b'\x00\x00\x01\x67', True), (b'\x00\x00\x01\xb3', True),
    (b'\xff\xd8\xff\xe0', True), (b'\x00\x00\x01\xba', False), (b'\x00\x00\x00\x18ftyp', False),
    (b'RIFF\x00\x00\x00\x00AVI ', False), (b'\x1aE\xdf\xa3', False), (b'G@\x11\x10', False)])
def test_which_streams_are_raw(fake, start, is_raw):
    path = fake([GREY] * 3, {cv2.CAP_PROP_FPS: 25.0})
    path.write_bytes(start + bytes(100))
    assert ('25 frames per second assumed' in open_source(path).description) == is_raw


def test_frames_declared_and_read(video):
    with open_source(video) as source:
        assert source.frames == SourceFrames(declared=8)
        assert len(list(source)) == 8
        assert (source.frames, source.frames.missing) == (SourceFrames(8, 8), 0)
    # Each frame is a chunk of this name.
    *chunks, _ = video.read_bytes().split(b'00dc')[:6]
    video.write_bytes(b'00dc'.join(chunks))
    with open_source(video, selection=Selection(every=2)) as source:
        list(source)
        assert source.frames.declared == 8
        assert source.frames.missing == 8 - source.frames.read > 0


@pytest.mark.parametrize(('declared', 'read', 'missing'), [
    (None, 5, 0), (5, None, 0), (100, 50, 50), (100, 99, 0), (100, 97, 3), (5, 6, 0), (3, 2, 1)])
def test_a_few_missing_frames_are_those_of_a_rounded_duration(declared, read, missing):
    assert SourceFrames(declared, read).missing == missing
