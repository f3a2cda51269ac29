# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags on a ROS installation without rosbags; a fake module replaces rosbag2_py."""

from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
from phase_traj_ros.errors import MissingDependencyError, SourceError
from phase_traj_ros.io import open_source, Selection
import pytest
import yaml

pytestmark = pytest.mark.skipif(
    not (find_spec('rclpy') and find_spec('rosbags')), reason='needs rclpy and rosbags')

ROSBAGS = ('rosbags', 'rosbags.typesys', 'rosbags.rosbag1', 'rosbags.rosbag2')
SECOND = 1_000_000_000


def stand_in(opened):
    """Return a fake rosbag2_py that reads with rosbags."""
    from rosbags.rosbag2 import Reader

    class StorageOptions:

        def __init__(self, *, uri, storage_id=''):
            self.uri, self.storage_id = uri, storage_id

    class ConverterOptions:

        def __init__(self, input_serialization_format, output_serialization_format):
            pass

    class StorageFilter:

        def __init__(self, *, topics):
            self.topics = topics

    class MetadataIo:

        def read_metadata(self, uri):
            text = (Path(uri) / 'metadata.yaml').read_text()
            try:
                mode = yaml.safe_load(text)['rosbag2_bagfile_information']['compression_mode']
            except TypeError as error:
                raise RuntimeError('Exception on parsing info file') from error
            return SimpleNamespace(compression_mode=mode)

    class SequentialReader:

        takes = ('', 'NONE')

        def open(self, storage_options, converter_options):  # noqa: A003
            opened.append((storage_options.uri, storage_options.storage_id))
            folder = Path(storage_options.uri)
            if folder.is_dir():
                mode = MetadataIo().read_metadata(folder).compression_mode.upper()
                assert mode in self.takes
                if mode == 'FILE':
                    # It decompresses into the folder of the bag.
                    next(folder.glob('*.zstd')).with_suffix('').touch()
            try:
                self._bag = Reader(storage_options.uri)
                self._bag.open()
            except Exception as error:
                raise RuntimeError('No storage could be initialized') from error
            self.set_filter(StorageFilter(topics=[]))

        def get_metadata(self):
            return SimpleNamespace(topics_with_message_count=[
                SimpleNamespace(
                    topic_metadata=SimpleNamespace(name=each.topic, type=each.msgtype),
                    message_count=each.msgcount)
                for each in self._bag.connections])

        def set_filter(self, storage_filter):
            self._messages = list(self._bag.messages(connections=[
                each for each in self._bag.connections
                if not storage_filter.topics or each.topic in storage_filter.topics]))

        def has_next(self):
            return bool(self._messages)

        def read_next(self):
            connection, received_ns, data = self._messages.pop(0)
            return connection.topic, bytes(data), received_ns

    class SequentialCompressionReader(SequentialReader):

        takes = ('FILE', 'MESSAGE')

    module = ModuleType('rosbag2_py')
    module.__spec__ = ModuleSpec('rosbag2_py', None)
    for kind in (StorageOptions, ConverterOptions, StorageFilter, MetadataIo, SequentialReader,
                 SequentialCompressionReader):
        setattr(module, kind.__name__, kind)
    return module


@pytest.fixture
def file(mcap_maker, bag):
    """Return the storage file of that bag."""
    return mcap_maker.single_file(bag)


@pytest.fixture
def opened(monkeypatch):
    """Hide rosbags and provide rosbag2_py; return its calls."""
    opened = []
    monkeypatch.setitem(sys.modules, 'rosbag2_py', stand_in(opened))
    for name in ROSBAGS:
        monkeypatch.setitem(sys.modules, name, None)
    return opened


@pytest.fixture
def bag(mcap_maker, tmp_path):
    """Return a bag of five frames."""
    return mcap_maker.drive(tmp_path / 'bag', frames=5)


def test_frames_calibration_and_speeds(bag, opened, drive_frame):
    with open_source(bag) as source:
        assert source.frame_count == 5
        assert source.camera(rectified=False) is None
        with pytest.raises(SourceError, match='no speed on /speed'):
            list(source.speeds('/speed'))
        frames = list(source)
        assert len(list(source)) == 5
    assert [each.stamp_ns for each in frames] == [
        100 * SECOND + index * SECOND // 10 for index in range(5)]
    for index, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.image, drive_frame(index))
    assert set(opened) == {(str(bag), '')}


def test_a_single_file_says_how_it_is_stored(file, opened):
    with open_source(file, selection=Selection(every=2)) as source:
        assert len(list(source)) == 3
    assert set(opened) == {(str(file), 'mcap')}


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def compressed(mcap_maker, tmp_path, monkeypatch):
    """Return a function that writes five frames as ``ros2 bag record`` compresses them."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, Writer

    def write(mode):
        class Compressing(Writer):

            def open(self):  # noqa: A003
                self.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
                super().open()

        with monkeypatch.context() as patch:
            patch.setattr('rosbags.rosbag2.Writer', Compressing)
            return mcap_maker.drive(tmp_path / 'compressed', frames=5)

    return write


@pytest.mark.parametrize('mode', ['FILE', 'MESSAGE'])
def test_compressed_bags_are_read_and_stay_as_they_are(
        compressed, mode, request, drive_frame):
    folder = compressed(mode)
    opened = request.getfixturevalue('opened')
    before = files(folder)
    with open_source(folder) as source:
        frames = list(source)
    assert len(frames) == 5
    np.testing.assert_array_equal(frames[4].image, drive_frame(4))
    assert files(folder) == before
    decompressed_in = {Path(uri) for uri, _ in opened} - {folder}
    assert bool(decompressed_in) == (mode == 'FILE')
    assert not any(each.exists() for each in decompressed_in)


def test_a_compressed_file_needs_its_folder(tmp_path):
    packed = tmp_path / 'bag_0.mcap.zstd'
    packed.write_bytes(b'packed')
    with pytest.raises(SourceError, match=f'give the folder of the bag, {tmp_path}'):
        open_source(packed)


def test_a_single_file_does_not_need_what_lies_beside_it(file, opened):
    (file.parent / 'metadata.yaml').write_text('nothing')
    with open_source(file) as source:
        assert len(list(source)) == 5


def test_a_broken_bag(bag, opened):
    (bag / 'metadata.yaml').write_text('nothing')
    with pytest.raises(SourceError, match=r'cannot be read as a ROS 2 bag .*parsing'):
        open_source(bag)


def test_without_either_the_interpreter_is_named(bag, monkeypatch):
    for name in (*ROSBAGS, 'rosbag2_py'):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingDependencyError) as caught:
        open_source(bag)
    assert f'{sys.executable} -m pip install rosbags' in str(caught.value)
    assert 'or source a ROS that has rosbag2_py' in str(caught.value)
