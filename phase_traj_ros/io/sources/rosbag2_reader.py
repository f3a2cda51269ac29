# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bags of ROS 2 read by the packages of a ROS installation, where rosbags is not installed.

The one module of io that asks ROS for help, and only when such a bag is opened there. It looks
like the reader of rosbags, as far as that is used.
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
    """Reads a ROS 2 bag with rosbag2_py; raises ImportError where that is not to be had."""

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
        # Of a directory, metadata.yaml says how it is stored.
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
    """Return the message of the type, such as ``sensor_msgs/msg/Image``, in serialised data."""
    package, _, name = msgtype.split('/')
    kind = getattr(import_module(f'{package}.msg'), name)
    return import_module('rclpy.serialization').deserialize_message(data, kind)
