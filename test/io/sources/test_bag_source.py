# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Images and their stamps from intact and broken bags."""

from importlib.util import find_spec
from pathlib import Path
import re
import threading

import numpy as np
from phase_traj_ros.core.camera.model import Distortion
from phase_traj_ros.errors import (
    CalibrationError,
    FrameError,
    SourceError,
)
from phase_traj_ros.io import open_source, prefetch, Selection
from phase_traj_ros.io.replay.camera import known_lens
from phase_traj_ros.parameters import Parameters
import pytest

SECOND = 1_000_000_000
IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED = 'sensor_msgs/msg/CompressedImage'
STRING = 'std_msgs/msg/String'
INFO = 'sensor_msgs/msg/CameraInfo'


def stamps_of(path, **options):
    with open_source(path, **options) as source:
        return [frame.stamp_ns for frame in source]


def test_frames_and_stamps(tmp_path, maker, drive_frame):
    with open_source(maker.drive(tmp_path / 'bag', frames=4)) as source:
        assert source.frame_count == 4
        assert 'bag' in source.description
        assert '/camera/image_raw' in source.description
        frames = list(source)
    assert [frame.stamp_ns for frame in frames] == [
        100 * SECOND + index * SECOND // 10 for index in range(4)]
    for index, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.image, drive_frame(index))


def test_single_file(tmp_path, maker):
    path = maker.drive(tmp_path / 'bag')
    file = maker.single_file(path)
    if path.is_dir():
        (path / 'metadata.yaml').unlink()
    assert len(stamps_of(file)) == 5


@pytest.mark.parametrize('name', ['drive.bag', 'DRIVE.BAG', 'drive.mcap'])
def test_a_directory_is_a_bag_of_ros_2_whatever_its_name(tmp_path, mcap_maker, name):
    with open_source(mcap_maker.drive(tmp_path / name)) as source:
        assert 'ROS 2 bag' in source.description
        assert len(list(source)) == 5


@pytest.mark.parametrize('suffix', ['.png', '.jpg'])
def test_compressed_images(tmp_path, maker, drive_frame, suffix):
    path = maker.write(tmp_path / 'bag', {'/camera/compressed': (COMPRESSED, [
        (index * SECOND, maker.compressed(drive_frame(index), index * SECOND, suffix))
        for index in range(1, 4)])})
    with open_source(path) as source:
        frames = list(source)
    assert [frame.stamp_ns for frame in frames] == [SECOND, 2 * SECOND, 3 * SECOND]
    for index, frame in enumerate(frames, 1):
        difference = np.abs(frame.image.astype(int) - drive_frame(index))
        assert difference.max() <= (0 if suffix == '.png' else 12)


def test_16_bit_images(tmp_path, maker):
    image = np.arange(24 * 32, dtype=np.uint16).reshape(24, 32) * 80
    path = maker.write(tmp_path / 'bag', {
        '/image': (IMAGE, [(SECOND, maker.image(image, SECOND, 'mono16'))])})
    with open_source(path) as source:
        (frame,) = source
    np.testing.assert_array_equal(frame.image, image)


def several_topics(maker, path, drive_frame, right_messages=1):
    image = maker.image(drive_frame(0), SECOND)
    return maker.write(path, {
        '/left/image': (IMAGE, [(SECOND, image), (2 * SECOND, image)]),
        '/right/image': (IMAGE, [(SECOND, image)] * right_messages),
        '/chatter': (STRING, [(SECOND, maker.text('hello'))]),
    })


def test_several_image_topics(tmp_path, maker, drive_frame):
    path = several_topics(maker, tmp_path / 'bag', drive_frame)
    with pytest.raises(SourceError, match=r'several image topics.*give one as') as caught:
        open_source(path)
    message = str(caught.value)
    assert '/left/image (sensor_msgs/msg/Image, 2 messages)' in message
    assert '/right/image (sensor_msgs/msg/Image, 1 message)' in message
    assert 'chatter' not in message
    assert len(stamps_of(path, topic='/left/image')) == 2
    assert len(stamps_of(path, topic='right/image')) == 1


def test_topic_without_messages_does_not_count(tmp_path, maker, drive_frame):
    path = several_topics(maker, tmp_path / 'bag', drive_frame, right_messages=0)
    assert len(stamps_of(path)) == 2
    with open_source(path, topic='/right/image') as source:
        assert source.frame_count is None
        with pytest.raises(SourceError, match='no frame could be read'):
            list(source)


@pytest.mark.parametrize('topic', ['/nothing', '/chatter'])
def test_unknown_topic(tmp_path, maker, topic):
    with pytest.raises(SourceError, match=f'no image topic {topic}; .*/camera/image_raw .*5 mes'):
        open_source(maker.drive(tmp_path / 'bag'), topic=topic)


def test_no_images(tmp_path, maker):
    path = maker.write(tmp_path / 'bag', {
        f'/chatter{index:02}': (STRING, [(SECOND, maker.text('hello'))]) for index in range(30)})
    with pytest.raises(SourceError, match=r'no image topic; it has .*chatter00.*and 10 more'):
        open_source(path)


def test_empty_bag(tmp_path, maker):
    with pytest.raises(SourceError, match='no image topic; it has no topics at all'):
        open_source(maker.write(tmp_path / 'bag', {}))


def test_foreign_messages_do_not_matter(tmp_path, mcap_maker, drive_frame):
    """A type without a known definition, and a topic with two types."""
    rosbag2 = pytest.importorskip('rosbags.rosbag2')
    path = tmp_path / 'bag'
    store = mcap_maker.typestore
    with rosbag2.Writer(
            path, version=8, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        foreign = writer.add_connection(
            '/foreign', 'acme_msgs/msg/Thing', msgdef='this is { no definition',
            rihs01='RIHS01_' + '0' * 64)
        mixed = writer.add_connection('/image', STRING, typestore=store)
        image = writer.add_connection('/image', IMAGE, typestore=store)
        for index in range(3):
            writer.write(foreign, index, b'\xff' * 9)
            writer.write(mixed, index, store.serialize_cdr(mcap_maker.text('x'), STRING))
            msg = mcap_maker.image(drive_frame(index), SECOND + index)
            writer.write(image, index, store.serialize_cdr(msg, IMAGE))
    assert stamps_of(path) == [SECOND, SECOND + 1, SECOND + 2]


@pytest.mark.parametrize(('stamps', 'expected'), [
    ([0, 0, 0], [10, 11, 12]),
    ([0, 5, 6], [0, 5, 6]),
    ([0], [0]),
    ([0, 0, 5], [10, 11, 5]),
    ([5, 0, 0], [5, 0, 0]),
])
def test_zero_stamps(tmp_path, maker, drive_frame, stamps, expected):
    path = maker.write(tmp_path / 'bag', {'/image': (IMAGE, [
        (10 + index, maker.image(drive_frame(0), stamp))
        for index, stamp in enumerate(stamps)])})
    assert stamps_of(path) == expected


def test_selection_of_a_bag_without_stamps(tmp_path, maker, drive_frame):
    path = maker.write(tmp_path / 'bag', {'/image': (IMAGE, [
        ((100 + index) * SECOND, maker.image(drive_frame(0), 0)) for index in range(6)])})
    assert stamps_of(path, selection=Selection(start=2, duration=3)) == [
        102 * SECOND, 103 * SECOND, 104 * SECOND]


def test_frame_count(tmp_path, maker):
    path = maker.drive(tmp_path / 'bag', frames=5)
    assert open_source(path, selection=Selection(every=2)).frame_count == 3
    assert open_source(path, selection=Selection(start=0.1)).frame_count is None
    assert open_source(path, selection=Selection(duration=0.1)).frame_count is None


def test_only_selected_messages_are_converted(tmp_path, maker, drive_frame):
    good, bad = (maker.image(drive_frame(0), SECOND, name) for name in ('mono8', 'nonsense'))
    path = maker.write(tmp_path / 'bag', {
        '/image': (IMAGE, [(1, good), (2, bad), (3, good), (4, bad)])})
    assert len(stamps_of(path, selection=Selection(every=2))) == 2
    with open_source(path) as source, pytest.raises(
            FrameError, match=r"topic /image, message 1: .*'nonsense' is unknown"):
        list(source)


def test_message_that_is_cut_off(tmp_path, maker, drive_frame):
    path = maker.drive(tmp_path / 'bag')
    whole = maker.single_file(path).read_bytes()
    row = drive_frame(3)[12].tobytes()
    # The number of data bytes directly precedes them.
    count = (24 * 32).to_bytes(4, 'little')
    place = whole.index(row) - 12 * 32 - 4
    if maker.kind == 'sqlite3' and whole[place:place + 4] != count:
        pytest.skip('the database has split the message')
    assert whole[place:place + 4] == count
    maker.single_file(path).write_bytes(
        whole[:place] + (2 ** 31 - 1).to_bytes(4, 'little') + whole[place + 4:])
    with open_source(path) as source, pytest.raises(
            SourceError, match=r'cannot be read as a ROS . bag') as caught:
        list(source)
    assert '\n' not in str(caught.value)


def test_in_a_background_thread(tmp_path, maker):
    """Everything is opened, read and closed in that thread."""
    with open_source(maker.drive(tmp_path / 'bag')) as source:
        assert len(list(prefetch(source))) == 5
        frames = prefetch(source)
        next(frames)
        frames.close()
    assert all(thread.name != 'prefetch' for thread in threading.enumerate())


def test_file_is_closed(tmp_path, maker):
    path = maker.drive(tmp_path / 'bag')
    descriptors = Path('/proc/self/fd')
    if not descriptors.is_dir():
        pytest.skip('needs /proc')

    def open_files():
        links = [entry.resolve() for entry in descriptors.iterdir()]
        return sum(tmp_path in link.parents for link in links)

    with open_source(path) as source:
        # Some combinations of Python and SQLite keep one of the reader's two handles.
        kept = open_files()
        assert kept == 0 or maker.kind == 'sqlite3'
        iterator = iter(source)
        next(iterator)
        during = open_files()
        assert during > kept
        iterator.close()
        assert open_files() < during


@pytest.mark.parametrize('kept', [0.1, 0.5, 0.9, 0.999])
def test_recording_that_was_cut_off(tmp_path, maker, kept):
    if maker.kind == 'mcap' and not find_spec('rosbags'):
        pytest.skip('rosbag2_py reads what is left of an mcap file')
    path = maker.drive(tmp_path / 'bag', frames=8)
    file = maker.single_file(path)
    whole = file.read_bytes()
    file.write_bytes(whole[:int(len(whole) * kept)])
    if maker.kind == 'sqlite3' and kept > 0.99:
        # The end of the last page is free space.
        assert len(stamps_of(path)) == 8
        return
    for each in {path, file}:
        with pytest.raises(SourceError, match=r'\(.+\); if .* reindex|\(.+\); if .* recover'):
            stamps_of(each)


@pytest.mark.parametrize('text', [
    '', 'hello', '[1, 2', 'rosbag2_bagfile_information:', 'rosbag2_bagfile_information: {}',
    'rosbag2_bagfile_information: {version: 99}', '\x00\x01', 'a: &a [*a]',
])
def test_broken_metadata(tmp_path, mcap_maker, text):
    path = mcap_maker.drive(tmp_path / 'bag')
    (path / 'metadata.yaml').write_text(text)
    with pytest.raises(SourceError, match='ros2 bag reindex') as caught:
        open_source(path)
    assert '\n' not in str(caught.value)


def test_missing_storage_file(tmp_path, mcap_maker):
    path = mcap_maker.drive(tmp_path / 'bag')
    next(path.glob('*.mcap')).unlink()
    with pytest.raises(SourceError, match='missing'):
        open_source(path)


def calibrated(maker, path, drive_frame, infos, *, topic='/camera/camera_info', msgtype=INFO):
    """Write a bag with one image and, on a topic, the given messages."""
    return maker.write(path, {
        '/camera/image_raw': (IMAGE, [(SECOND, maker.image(drive_frame(0), SECOND))]),
        '/right/camera_info': (INFO, [(0, maker.camera_info(focal=99.0))]),
        topic: (msgtype, [(index, info) for index, info in enumerate(infos, 1)])})


def test_first_calibration_beside_the_images(tmp_path, maker, drive_frame):
    path = calibrated(maker, tmp_path / 'bag', drive_frame, [
        maker.camera_info(focal=30.0), maker.camera_info(focal=40.0)])
    with open_source(path) as source:
        raw, rectified = (source.camera(rectified=each) for each in (False, True))
        assert len(list(source)) == 1
    assert (raw.fx, raw.shape, raw.distortion) == (30.0, (24, 32), Distortion.BROWN)
    assert raw.coefficients == (-0.1, 0.0, 0.0, 0.0, 0.0)
    assert (rectified.fx, rectified.distortion) == (31.0, Distortion.NONE)


def test_a_calibration_that_cannot_be_used_is_passed_over(tmp_path, maker, drive_frame):
    none, good = maker.camera_info(focal=0.0), maker.camera_info(focal=44.0)
    with open_source(calibrated(maker, tmp_path / 'bag', drive_frame, [none, good])) as source:
        assert source.camera(rectified=False).fx == 44.0


def test_calibration_of_compressed_images(tmp_path, maker, drive_frame):
    path = maker.write(tmp_path / 'bag', {
        '/camera/image_raw/compressed': (
            COMPRESSED, [(SECOND, maker.compressed(drive_frame(0), SECOND))]),
        '/camera/camera_info': (INFO, [(SECOND, maker.camera_info(focal=33.0))])})
    with open_source(path) as source:
        assert source.camera(rectified=False).fx == 33.0


def test_no_calibration(tmp_path, maker, drive_frame):
    with open_source(maker.drive(tmp_path / 'none')) as source:
        assert source.camera(rectified=False) is None
    path = calibrated(maker, tmp_path / 'empty', drive_frame, [])
    with open_source(path) as source:
        assert source.camera(rectified=False) is None
    path = calibrated(
        maker, tmp_path / 'other', drive_frame, [maker.text('hello')], msgtype=STRING)
    with open_source(path) as source:
        assert source.camera(rectified=False) is None


def test_a_calibrated_camera_is_tilted_as_the_parameters_say(tmp_path, maker, drive_frame):
    path = calibrated(maker, tmp_path / 'bag', drive_frame, [maker.camera_info()])
    with open_source(path) as source:
        lens, _ = known_lens(source, Parameters(camera_pitch_deg=20.0, camera_roll_deg=-5.0))
    assert lens.camera is not None and (lens.pitch_deg, lens.roll_deg) == (20.0, -5.0)
    assert lens.tilt == pytest.approx(np.cos(np.radians(20.0)) * np.cos(np.radians(5.0)))


def test_calibration_that_cannot_be_used(tmp_path, maker, drive_frame):
    info = maker.camera_info(focal=0.0, width=0, height=0)
    path = calibrated(maker, tmp_path / 'bag', drive_frame, [info])
    with open_source(path) as source:
        message = r'bag.*, topic /camera/camera_info: the camera is not calibrated \(K'
        with pytest.raises(CalibrationError, match=message):
            source.camera(rectified=False)
        # The camera is learned then, which a user should know.
        lens, unused = known_lens(source, Parameters())
        assert lens is None and re.search(message, unused)
        assert len(list(source)) == 1


def test_calibration_that_is_cut_off(tmp_path, maker, drive_frame, monkeypatch):
    info = maker.camera_info()
    name = f'serialize_{"ros1" if maker.kind == "ros1" else "cdr"}'
    serialise = getattr(maker.typestore, name)

    def cut_off(msg, msgtype):
        data = serialise(msg, msgtype)
        return data[:len(data) // 2] if msg is info else data

    monkeypatch.setattr(maker.typestore, name, cut_off)
    path = calibrated(maker, tmp_path / 'bag', drive_frame, [info])
    with open_source(path) as source:
        message = r'bag.*, topic /camera/camera_info, message 0 cannot be read as a ROS'
        with pytest.raises(SourceError, match=message) as caught:
            source.camera(rectified=True)
        assert '\n' not in str(caught.value)
        assert len(list(source)) == 1
