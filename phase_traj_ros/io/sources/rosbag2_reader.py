# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
ROS 2 bags read with the packages of a ROS installation, if rosbags is not installed.

This is the only module of io that uses ROS, and only when such a bag is opened. It has the same
interface as the reader of rosbags, as far as that is used.
"""

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any

_STORAGE = MappingProxyType({'.mcap': 'mcap', '.db3': 'sqlite3'})


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

    def __enter__(self) -> 'Rosbag2Reader':
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def open(self) -> None:  # noqa: A003
        """Open the bag."""
        # For a directory, metadata.yaml gives the storage format.
        storage = '' if self._path.is_dir() else _STORAGE[self._path.suffix.lower()]
        self._reader = self._rosbag2.SequentialReader()
        self._reader.open(
            self._rosbag2.StorageOptions(uri=str(self._path), storage_id=storage),
            self._rosbag2.ConverterOptions('', ''))

    def close(self) -> None:
        """Release the bag."""
        self._reader = None

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


def deserialise(data: bytes, msgtype: str) -> object:
    """Deserialise a message of a type such as ``sensor_msgs/msg/Image``."""
    package, _, name = msgtype.split('/')
    kind = getattr(import_module(f'{package}.msg'), name)
    return import_module('rclpy.serialization').deserialize_message(data, kind)
