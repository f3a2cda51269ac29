# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Videos read by PyAV: times, numbers, seeking, and the same pictures as by OpenCV."""

from fractions import Fraction

import av
import cv2
import numpy as np
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io import open_source, Selection
from phase_traj_ros.io.sources.base import SourceFrames, StampedFrame, UnreadableFrame
from phase_traj_ros.io.sources.pyav_video import PyavSource
from phase_traj_ros.io.sources.video import VideoSource
import pytest

TENTH = 100_000_000


@pytest.fixture
def textured(picture):
    """Return picture number ``index`` of a drive, BGR."""
    scene = cv2.resize(picture(), (160, 96))

    def made(index):
        return np.roll(scene, 4 * index, axis=1)
    return made


@pytest.fixture
def write(tmp_path, textured):
    """Return a writer of videos with a frame at each of the times, in milliseconds."""
    def written(name, times, *, codec='mpeg4', pix_fmt='yuv420p', pixels=None, **options):
        path = tmp_path / name
        with av.open(str(path), 'w') as container:
            stream = container.add_stream(codec, rate=10, options={'g': '8', **options})
            stream.width, stream.height, stream.pix_fmt = 160, 96, pix_fmt
            if pixels is not None:
                stream.codec_context.sample_aspect_ratio = pixels
            # AVI has a constant rate.
            base = Fraction(1, 10 if name.endswith('.avi') else 1000)
            stream.time_base = stream.codec_context.time_base = base
            for index, time in enumerate(times):
                frame = av.VideoFrame.from_ndarray(textured(index), format='bgr24')
                frame.pts, frame.time_base = round(time / 1000 / base), base
                container.mux(stream.encode(frame))
            container.mux(stream.encode())
        return path
    return written


def evenly(count):
    return [100 * index for index in range(count)]


def test_opening_prefers_it(write):
    assert isinstance(open_source(write('a.mp4', evenly(3))), PyavSource)


@pytest.mark.parametrize('name', ['a.mp4', 'a.mkv', 'a.avi'])
def test_frames_times_and_numbers(write, name):
    with PyavSource(write(name, evenly(20))) as source:
        frames = list(source)
        assert source.frames.read == 20 and source.frame_count == 20
        assert source.frames.missing == 0
    assert [frame.stamp_ns for frame in frames] == [index * TENTH for index in range(20)]
    assert [frame.number for frame in frames] == list(range(20))
    assert all(frame.image.shape == (96, 160) and frame.image.dtype == np.uint8
               for frame in frames)


def test_a_variable_rate_keeps_its_times(write):
    times = [0, 40, 140, 141, 500, 533, 900, 2000, 2010]
    with PyavSource(write('a.mkv', times)) as source:
        assert [frame.stamp_ns for frame in source] == [time * 10**6 for time in times]


def test_times_count_from_the_first_frame(write):
    with PyavSource(write('a.mkv', [5000, 5100, 5300])) as source:
        assert [frame.stamp_ns for frame in source] == [0, TENTH, 3 * TENTH]


CONTAINERS = [
    ('a.mp4', 'mpeg4'), ('a.mkv', 'mpeg4'), ('a.avi', 'mpeg4'), ('a.ts', 'mpeg4'),
    ('a.mp4', 'libx264'), ('a.avi', 'libx264'), ('a.ts', 'libx264'), ('a.flv', 'libx264'),
    ('a.mpg', 'mpeg4'), ('a.asf', 'libx264')]


def assert_selects_the_same(path, selection):
    """Assert that the frames of a selection are those that reading everything gives."""
    everything = list(PyavSource(path))
    stamps = range(selection.start_ns, 10**10 if selection.end_ns is None else selection.end_ns)
    expected = [frame for frame in everything if frame.stamp_ns in stamps][::selection.every]
    with PyavSource(path, selection=selection) as source:
        found = list(source)
    assert [(frame.number, frame.stamp_ns) for frame in found] == [
        (frame.number, frame.stamp_ns) for frame in expected]
    assert all(np.array_equal(one.image, other.image) for one, other in zip(found, expected))


@pytest.mark.parametrize(('name', 'codec'), CONTAINERS)
@pytest.mark.parametrize('selection', [
    Selection(start=1.25), Selection(start=0.05, every=3), Selection(start=2.1, duration=0.35),
    Selection(start=3.85), Selection(every=7), Selection(start=0.8, duration=1.0, every=2)])
def test_a_start_gives_the_same_frames_as_reading_all(write, name, codec, selection):
    # B frames: packets in another order than frames.
    assert_selects_the_same(write(name, evenly(40), codec=codec, bf='2'), selection)


@pytest.mark.parametrize('name', ['a.mkv', 'a.ts'])
def test_a_start_where_key_frames_show_a_part(write, name):
    path = write(name, evenly(40), codec='libx264', **{'x264-params': 'intra-refresh=1'})
    assert_selects_the_same(path, Selection(start=2.1))


def test_a_start_in_the_second_of_two_concatenated_files(write):
    path = write('a.ts', evenly(20), codec='libx264')
    path.write_bytes(2 * path.read_bytes())
    assert_selects_the_same(path, Selection(start=2.5))


@pytest.mark.parametrize('name', ['a.mkv', 'a.mp4', 'a.ts'])
def test_a_start_in_a_file_that_begins_between_key_frames(write, tmp_path, name):
    whole, path = write(f'whole_{name}', evenly(40), bf='2'), tmp_path / name
    with av.open(str(whole)) as source, av.open(str(path), 'w') as container:
        stream = container.add_stream_from_template(source.streams.video[0])
        for packet in [each for each in source.demux() if each.size][5:]:
            packet.stream = stream
            container.mux(packet)
    assert_selects_the_same(path, Selection(start=2.1))


def test_what_is_before_the_start_is_not_decoded(write, monkeypatch):
    decoded = []
    pictures = PyavSource._pictures

    def counted(self, *given):
        for frame in pictures(self, *given):
            decoded.append(frame)
            yield frame

    monkeypatch.setattr(PyavSource, '_pictures', counted)
    with PyavSource(write('a.mp4', evenly(40)), selection=Selection(start=3.5)) as source:
        assert len(list(source)) == 5
    # From a key frame on, of which there is one in eight.
    assert len(decoded) <= 8 + 5


def test_a_given_rate_holds_also_after_a_start(write):
    path = write('a.mkv', [0, 40, 140, 141, 500, 533])
    with PyavSource(path, fps=4, selection=Selection(start=0.6)) as source:
        assert [(frame.number, frame.stamp_ns) for frame in source] == [
            (3, 750_000_000), (4, 10**9), (5, 1_250_000_000)]


def test_a_start_after_the_end(write):
    source = PyavSource(write('a.mp4', evenly(5)), selection=Selection(start=9.0))
    with pytest.raises(SourceError, match='no frame is selected'):
        list(source)


def test_the_pictures_are_those_of_opencv(write):
    path = write('a.mp4', evenly(10))
    for one, other in zip(PyavSource(path), VideoSource(path), strict=True):
        assert one.stamp_ns == other.stamp_ns
        # The luma has not the full range: 16 to 235.
        stretched = (one.image.astype(float) - 16) * 255 / 219
        assert np.abs(stretched - other.image).mean() < 3


@pytest.mark.parametrize(('codec', 'pix_fmt'), [('ffv1', 'bgr0'), ('ffv1', 'yuv420p10le')])
def test_other_formats_become_grey(write, codec, pix_fmt):
    path = write('a.mkv', evenly(3), codec=codec, pix_fmt=pix_fmt)
    for one, other in zip(PyavSource(path), VideoSource(path), strict=True):
        assert one.image.shape == (96, 160) and one.image.dtype == np.uint8
        assert np.corrcoef(one.image.ravel(), other.image.ravel())[0, 1] > 0.99


def turned(path, matrix):
    """Write the matrix by which the pictures of an MP4 are to be rotated, as telephones do."""
    data = bytearray(path.read_bytes())
    at = data.index(b'tkhd') + 4 + 40
    data[at:at + 36] = np.array(matrix, '>i4').tobytes()
    path.write_bytes(data)
    return path


ONE = 1 << 16


@pytest.mark.skipif(
    int(cv2.__version__.split('.')[0]) < 5, reason='OpenCV 4.6 turns quarter turns the other way')
@pytest.mark.parametrize('matrix', [
    [0, ONE, 0, -ONE, 0, 0, 0, 0, 1 << 30], [0, -ONE, 0, ONE, 0, 0, 0, 0, 1 << 30],
    [-ONE, 0, 0, 0, -ONE, 0, 0, 0, 1 << 30]])
def test_rotated_videos_are_upright(write, matrix):
    path = turned(write('a.mp4', evenly(2)), matrix)
    one, other = next(iter(PyavSource(path))).image, next(iter(VideoSource(path))).image
    assert one.shape == other.shape
    assert np.corrcoef(one.ravel(), other.ravel())[0, 1] > 0.99


@pytest.mark.parametrize('reader', [PyavSource, VideoSource])
@pytest.mark.parametrize(('pixels', 'width'), [
    (Fraction(4, 3), 213), (Fraction(16, 15), 171), (Fraction(3, 4), 120), (Fraction(1), 160)])
def test_pixels_that_are_not_square_become_square(write, textured, reader, pixels, width):
    frame = next(iter(reader(write('a.mp4', evenly(2), pixels=pixels))))
    assert frame.image.shape == (96, width)
    shown = cv2.resize(cv2.cvtColor(textured(0), cv2.COLOR_BGR2GRAY), (width, 96))
    assert np.corrcoef(frame.image.ravel(), shown.ravel())[0, 1] > 0.97


@pytest.mark.parametrize('reader', [PyavSource, VideoSource])
def test_pixels_become_square_before_a_rotation(write, textured, reader):
    path = turned(
        write('a.mp4', evenly(2), pixels=Fraction(4, 3)), [0, ONE, 0, -ONE, 0, 0, 0, 0, 1 << 30])
    image = next(iter(reader(path))).image
    stored = cv2.resize(cv2.cvtColor(textured(0), cv2.COLOR_BGR2GRAY), (213, 96))
    # OpenCV 4.6 turns quarter turns the other way.
    assert image.shape == (213, 96)
    assert max(np.corrcoef(image.ravel(), np.rot90(stored, quarters).ravel())[0, 1]
               for quarters in (1, 3)) > 0.97


def test_a_raw_stream(tmp_path, textured):
    path = tmp_path / 'raw.mjpeg'
    path.write_bytes(b''.join(
        cv2.imencode('.jpg', textured(index))[1].tobytes() for index in range(8)))
    with PyavSource(path) as source:
        assert 'frames per second assumed' in source.description
        stamps = [frame.stamp_ns for frame in source]
        assert source.frames == SourceFrames(declared=None, read=8)
    assert len(stamps) == 8 and np.ptp(np.diff(stamps)) == 0


def test_damaged_frames_are_told_from_good_ones(write):
    path = write('a.mkv', evenly(12), codec='mjpeg', pix_fmt='yuvj420p')
    data = path.read_bytes()
    starts = [at for at in range(len(data) - 2) if data[at:at + 3] == b'\xff\xd8\xff']
    damaged = bytearray(data)
    # Without the header of the next frame.
    damaged[starts[5]:starts[6] - 40] = bytes(starts[6] - 40 - starts[5])
    path.write_bytes(damaged)
    with PyavSource(path) as source:
        entries = list(source.entries())
    assert [entry.number for entry in entries] == list(range(12))
    assert [type(entry) for entry in entries] == [
        UnreadableFrame if number == 5 else StampedFrame for number in range(12)]
    assert 'frame 5 of the video cannot be decoded' in entries[5].reason
    # The others keep their times.
    assert [entry.stamp_ns for entry in entries] == [number * TENTH for number in range(12)]
    with PyavSource(path, selection=Selection(start=0.25)) as source:
        selected = list(source.entries())
    assert [(type(entry), entry.number, entry.stamp_ns) for entry in selected] == [
        (type(entry), entry.number, entry.stamp_ns) for entry in entries[3:]]


@pytest.mark.parametrize('name', ['a.avi', 'a.mkv'])
def test_a_file_that_is_cut_off(write, name):
    path = write(name, evenly(40))
    data = path.read_bytes()
    path.write_bytes(data[:len(data) // 2])
    with PyavSource(path) as source:
        list(source.entries())
        assert source.frames.declared == 40 and source.frames.missing > 10


@pytest.mark.parametrize('times', [
    evenly(40), [3000 + time for time in evenly(40)], [0, 50, 100, 900, 1000, 2900, 3000]])
@pytest.mark.parametrize('name', ['a.mkv', 'a.mp4', 'a.ts'])
def test_a_whole_file_misses_nothing(write, name, times):
    with PyavSource(write(name, times)) as source:
        list(source.entries())
        assert source.frames.missing == 0


def test_what_a_trimmed_video_hides_is_not_missing(write, tmp_path):
    whole, path = write('whole.mp4', evenly(40)), tmp_path / 'trimmed.mp4'
    with av.open(str(whole)) as source, av.open(
            str(path), 'w', options={'avoid_negative_ts': 'disabled'}) as container:
        stream = container.add_stream_from_template(source.streams.video[0])
        for packet in [each for each in source.demux() if each.size]:
            for name in ('pts', 'dts'):
                setattr(packet, name, getattr(packet, name) - round(1.5 / packet.time_base))
            packet.stream = stream
            container.mux(packet)
    with av.open(str(path)) as trimmed:
        assert trimmed.streams.video[0].frames == 40
    with PyavSource(path) as source:
        assert len(list(source.entries())) == source.frames.declared == 25
        assert source.frames.problem is None


@pytest.mark.parametrize('reader', [PyavSource, VideoSource])
def test_an_mp4_without_its_index_is_cut_off(write, reader):
    path = write('a.mp4', evenly(40))
    data = path.read_bytes()
    assert data.rindex(b'moov') > len(data) // 2
    path.write_bytes(data[:len(data) // 2])
    with pytest.raises(SourceError, match=r'a\.mp4 is cut off or damaged .*repair it'):
        reader(path)


@pytest.mark.parametrize('reader', [PyavSource, VideoSource])
def test_what_is_no_video(tmp_path, reader):
    path = tmp_path / 'a.mp4'
    path.write_bytes(b'\x00' * 500)
    with pytest.raises(SourceError, match=r'a\.mp4 cannot be opened as a video') as caught:
        reader(path)
    assert '\n' not in str(caught.value)


def test_sound_is_no_video(tmp_path):
    path = tmp_path / 'a.wav'
    with av.open(str(path), 'w') as container:
        stream = container.add_stream('pcm_s16le', rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), layout='mono')
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
    with pytest.raises(SourceError, match='holds no video'):
        PyavSource(path)


def test_a_stream_that_the_file_does_not_announce_is_ignored(write):
    """Dash cameras write their GPS data as such a stream."""
    path = write('drive.ts', evenly(60))
    size, content = 188, path.read_bytes()
    assert len(content) % size == 0
    # The start of a packet of the private stream 2, without content, on an identifier of its own.
    gps = bytes.fromhex('47430010 000001bf 00b2').ljust(size, b'\0')
    middle = len(content) // size // 2 * size
    path.write_bytes(content[:middle] + gps + content[middle:])
    assert len([*open_source(path)]) == 60
    assert len([*open_source(path, selection=Selection(start=3.0))]) == 30
