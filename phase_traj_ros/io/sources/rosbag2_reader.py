# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
ROS 2 bags read with the packages of a ROS installation, if rosbags is not installed.

This is the only module of io that uses ROS, and only when such a bag is opened. It has the same
interface as the reader of rosbags, as far as that is used.
"""

from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any


@dataclass(frozen=True, slots=True)
class Connection:
    """A topic of a bag."""

    topic: str
    msgtype: str
    msgcount: int

    def __str__(self) -> str:
        """Return its name, type and number of messages."""
        plural = '' if self.msgcount == 1 else 's'
        return f'{self.topic} ({self.msgtype}, {self.msgcount} message{plural})'


@dataclass(frozen=True, slots=True)
class Rosbag2Reader:
    """Reads an open ROS 2 bag."""

    rosbag2: Any
    """The module rosbag2_py."""
    reader: Any

    @property
    def connections(self) -> list[Connection]:
        """Return the topics of the bag."""
        return [
            Connection(each.topic_metadata.name, each.topic_metadata.type, each.message_count)
            for each in self.reader.get_metadata().topics_with_message_count]

    def messages(
        self, connections: Iterable[Connection],
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Yield the messages of these topics: topic, time of reception in ns, serialised data."""
        wanted = {each.topic: each for each in connections}
        self.reader.set_filter(self.rosbag2.StorageFilter(topics=list(wanted)))
        while self.reader.has_next():
            topic, data, received_ns = self.reader.read_next()
            yield wanted[topic], received_ns, data


@contextmanager
def opened(path: Path) -> Iterator[Rosbag2Reader]:
    """
    Open the bag ``path``, a directory or a file.

    Raises
    ------
    ImportError
        rosbag2_py is not installed.

    """
    rosbag2: Any = import_module('rosbag2_py')
    # The storage format of a directory is in its metadata.yaml, and so is what is compressed.
    storage, compressed = '', 'NONE'
    if path.is_dir():
        metadata = rosbag2.MetadataIo().read_metadata(str(path))
        compressed = str(metadata.compression_mode).upper() or compressed
    else:
        storage = 'mcap' if path.suffix.lower() == '.mcap' else 'sqlite3'
    with _linked(path) if compressed == 'FILE' else nullcontext(path) as place:
        reader = (
            rosbag2.SequentialReader() if compressed == 'NONE'
            else rosbag2.SequentialCompressionReader())
        reader.open(
            rosbag2.StorageOptions(uri=str(place), storage_id=storage),
            rosbag2.ConverterOptions('', ''))
        yield Rosbag2Reader(rosbag2, reader)


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
