# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
ROS 2 bags read with the packages of a ROS installation, if rosbags is not installed.

This is the only module of io that uses ROS, and only when such a bag is opened. It has the same
interface as the reader of rosbags, as far as that is used.
"""

from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

from phase_traj_ros.errors import SourceError

_STORAGE = MappingProxyType({'.mcap': 'mcap', '.db3': 'sqlite3'})


class _Compression(Enum):
    """What rosbag2 has compressed; the value is that of metadata.yaml."""

    NONE = 'NONE'
    FILE = 'FILE'
    MESSAGE = 'MESSAGE'


@dataclass(frozen=True, slots=True)
class Connection:
    """A topic of a bag."""

    topic: str
    msgtype: str
    msgcount: int


class Rosbag2Reader:
    """Reads a ROS 2 bag with rosbag2_py; raises ImportError if that is not installed."""

    def __init__(self, path: Path) -> None:
        """Prepare to read the bag ``path``, a directory or a file."""
        self._rosbag2: Any = import_module('rosbag2_py')
        self._path = path
        self._reader: Any = None
        self._linked = ExitStack()

    def __enter__(self) -> 'Rosbag2Reader':
        """
        Open the bag.

        Raises
        ------
        SourceError
            The bag is a single file of compressed messages.

        """
        path, storage, compression = self._path, '', _Compression.NONE
        if path.is_dir():
            # Here metadata.yaml gives the storage format.
            compression = self._compression(path)
        else:
            storage = _STORAGE[path.suffix.lower()]
            self._check_file()
        if compression is _Compression.FILE:
            path = self._linked.enter_context(_linked(path))
        self._reader = (
            self._rosbag2.SequentialReader() if compression is _Compression.NONE
            else self._rosbag2.SequentialCompressionReader())
        self._reader.open(
            self._rosbag2.StorageOptions(uri=str(path), storage_id=storage),
            self._rosbag2.ConverterOptions('', ''))
        return self

    def __exit__(self, *_: object) -> None:
        """Release the bag."""
        self._reader = None
        self._linked.close()

    @property
    def connections(self) -> list[Connection]:
        """Return the topics of the bag."""
        return [
            Connection(each.topic_metadata.name, each.topic_metadata.type, each.message_count)
            for each in self._reader.get_metadata().topics_with_message_count]

    def messages(
        self, connections: Iterable[Connection],
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Yield the messages of these topics: topic, time of reception in ns, serialised data."""
        wanted = {each.topic: each for each in connections}
        self._reader.set_filter(self._rosbag2.StorageFilter(topics=list(wanted)))
        while self._reader.has_next():
            topic, data, received_ns = self._reader.read_next()
            yield wanted[topic], received_ns, data

    def _check_file(self) -> None:
        """Check that the messages of a single file are not compressed, which it does not tell."""
        folder = self._path.parent
        try:
            compression = self._compression(folder)
        except RuntimeError:
            return  # What lies beside the file need not belong to it.
        if compression is _Compression.MESSAGE:
            raise SourceError(
                f'the messages of {self._path} are compressed: give the folder {folder}, whose'
                ' metadata.yaml says how')

    def _compression(self, folder: Path) -> _Compression:
        """Return what is compressed in the bag of that folder, by its metadata.yaml."""
        metadata = self._rosbag2.MetadataIo()
        if not metadata.metadata_file_exists(str(folder)):
            return _Compression.NONE
        mode = str(metadata.read_metadata(str(folder)).compression_mode).upper()
        return _Compression(mode or _Compression.NONE.value)


def deserialise(data: bytes, msgtype: str) -> object:
    """Deserialise a message of a type such as ``sensor_msgs/msg/Image``."""
    package, _, name = msgtype.split('/')
    kind = getattr(import_module(f'{package}.msg'), name)
    return import_module('rclpy.serialization').deserialize_message(data, kind)


@contextmanager
def _linked(bag: Path) -> Iterator[Path]:
    """
    Yield a temporary folder with links to the files of a bag.

    rosbag2 decompresses a file into the folder in which it is. A recording must not change.
    """
    with TemporaryDirectory(prefix='phase_traj_bag_') as folder:
        linked = Path(folder) / bag.resolve().name
        linked.mkdir()
        for file in bag.iterdir():
            (linked / file.name).symlink_to(file.resolve())
        yield linked
