# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Frames from ROS 2 and ROS 1 bags, without ROS: read by rosbags, or else by rosbag2_py.

Only images, the CameraInfo of their camera, speeds and /tf_static are deserialised, with the
standard ROS definitions of these types. So a bag opens whatever other types it contains.
"""

from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path
from typing import Any

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.path.speed import is_speed
from phase_traj_ros.errors import (
    CalibrationError,
    FrameError,
    PhaseTrajError,
    rosbags_missing,
    SourceError,
)
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.messages.camera_info import camera_from_info, CAMERA_INFO_TYPE
from phase_traj_ros.io.messages.image import encoding_of, msg_to_frame
from phase_traj_ros.io.messages.mounting import Mount
from phase_traj_ros.io.messages.speed import SPEED_OF
from phase_traj_ros.io.messages.stamps import StampRule, to_nanoseconds
from phase_traj_ros.io.messages.static_frames import STATIC_TOPIC, StaticFrames, TF_TYPE
from phase_traj_ros.io.sources import rosbag2_reader
from phase_traj_ros.io.sources.base import Candidate, FrameSource, Speed
from phase_traj_ros.io.sources.rosbag2_reader import Connection
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection
from phase_traj_ros.topics import camera_info_topic

IMAGE_TYPES = ('sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage')

_MAX_LISTED_TOPICS = 20
_MAX_REASON = 200


class BagSource(FrameSource):
    """
    The images of one topic of a ROS 2 bag (a directory, a .mcap or .db3 file) or a ROS 1 .bag.

    Without a topic, the bag's only image topic (Image or CompressedImage) is used. Topics without
    messages are ignored if another image topic has some. Stamps are those of the headers, unless
    the driver left them zero (see StampRule).

    Raises SourceError if the bag cannot be read or the topic is ambiguous, and
    MissingDependencyError if neither rosbags nor, for a ROS 2 bag, rosbag2_py is installed.
    """

    def __init__(
        self,
        path: Path,
        *,
        topic: str | None = None,
        selection: Selection = EVERYTHING,
    ) -> None:
        self._path = path
        # A ROS 2 bag is a directory, whatever its suffix; a ROS 1 bag is a file.
        self._ros = 1 if path.suffix.lower() == '.bag' and not path.is_dir() else 2
        self._reader, self._deserialise = _access(path, self._ros)
        with self._errors_explained(), self._reader(path) as reader:
            self._topics = _topics_of(reader.connections)
        self._topic = _choose_topic(path, self._topics, topic)
        declared = self._topic.msgcount or None
        # The stamps, and so what is selected by time, are known after reading only.
        selects_by_time = selection.start or selection.duration is not None
        super().__init__(
            description=f'{path} (ROS {self._ros} bag, topic {self._topic.topic})',
            selection=selection, declared=declared,
            frame_count=None if declared is None or selects_by_time
            else len(range(0, declared, selection.every)))

    def camera(self, *, rectified: bool) -> CameraModel | None:
        """
        Return the camera model of the first valid CameraInfo for the image topic.

        None if there is no such message. Raises SourceError if a message cannot be read, and
        CalibrationError if none is valid.
        """
        topic = camera_info_topic(self._topic.topic)
        unusable: CalibrationError | None = None
        with closing(self._messages_of(topic, [CAMERA_INFO_TYPE])) as messages:
            for message, _ in messages:
                try:
                    return camera_from_info(message, rectified=rectified)
                except CalibrationError as error:
                    unusable = unusable or error
        if unusable is None:
            return None
        raise CalibrationError(f'{self._path}, topic {topic}: {unusable}') from unusable

    def mount(self, base_frame: str) -> Mount | None:
        """
        Return how the frame of the first image is mounted, by /tf_static; None if that is unknown.

        Raises SourceError if a message cannot be read.
        """
        if all(each.topic != STATIC_TOPIC for each in self._topics):
            return None
        frames = StaticFrames()
        with closing(self._messages_of(STATIC_TOPIC, [TF_TYPE])) as messages:
            for message, _ in messages:
                frames.add(message)
        with closing(self._messages_of(self._topic.topic, IMAGE_TYPES)) as images:
            first = next(images, None)
        return first and frames.mount(base_frame, first[0].header.frame_id)

    def speeds(self, topic: str) -> Iterator[Speed]:
        """
        Yield the speeds on a topic of one of SPEED_OF, stamped by their headers.

        If a header has no stamp, the time of reception is used. Impossible speeds (NaN, thousands
        of metres per second) are skipped. Raises SourceError.
        """
        name = topic if topic.startswith('/') else f'/{topic}'
        there = [each for each in self._topics if each.msgtype in SPEED_OF]
        msgtype = next((each.msgtype for each in there if each.topic == name), None)
        if msgtype is None:
            raise SourceError(
                f'{self._path} has no speed on {name}, that is, none of'
                f' {", ".join(SPEED_OF)}; topics with speeds:'
                f' {_listed(there, none="none")}; give one of them as the speed topic, or give the'
                ' parameter speed')
        for message, receive_ns in self._messages_of(name, [msgtype]):
            speed = SPEED_OF[msgtype](message)
            # The node warns of them; a bag cannot be corrected, so there is no warning here.
            if is_speed(speed):
                yield Speed(to_nanoseconds(message.header.stamp) or receive_ns, speed)

    def _messages_of(
        self, topic: str, msgtypes: Collection[str],
    ) -> Generator[tuple[Any, int], None, None]:
        """Yield the messages of a topic, deserialised, with their times of reception."""
        where = f', topic {topic}'
        with self._errors_explained(where), self._reader(self._path) as reader:
            connections = [
                each for each in reader.connections
                if each.topic == topic and each.msgtype in msgtypes]
            # Given no connections, rosbags would yield the messages of all topics.
            if not connections:
                return
            with closing(reader.messages(connections=connections)) as messages:
                for index, (connection, receive_ns, data) in enumerate(messages):
                    with self._errors_explained(f'{where}, message {index}'):
                        message = self._deserialise(data, connection.msgtype)
                    yield message, receive_ns

    def _candidates(self) -> Generator[Candidate, None, None]:
        with closing(self._messages_of(self._topic.topic, IMAGE_TYPES)) as messages:
            # Two zeros at the start identify a driver without stamps before the first one is used.
            head = list(islice(messages, 2))
            if not head and self._topic.msgcount > 0:
                raise SourceError(
                    f'{self._path}: its index has {self._topic.msgcount} messages on'
                    f' {self._topic.topic}, but none can be read; {self._hint()}')
            rule = StampRule(zero_seen=len(head) == 2 and all(
                to_nanoseconds(message.header.stamp) == 0 for message, _ in head))
            for index, (message, receive_ns) in enumerate(chain(head, messages)):
                yield Candidate(
                    index, rule.stamp_ns(to_nanoseconds(message.header.stamp), receive_ns),
                    partial(self._decode, message, index), encoding_of(message),
                    message.header.frame_id)

    def _decode(self, msg: object, index: int) -> GreyImage:
        try:
            return msg_to_frame(msg)
        except FrameError as error:
            raise FrameError(
                f'{self._path}, topic {self._topic.topic}, message {index}: {error}') from error

    @contextmanager
    def _errors_explained(self, where: str = '') -> Iterator[None]:
        """Convert any error that a broken file causes in the parsers to a SourceError."""
        try:
            yield
        except PhaseTrajError:
            raise
        # Damaged data can reach any line of the parsers (struct, assert, ord, sqlite,
        # decompressors, no memory for an impossible length), so any exception is expected here.
        except Exception as error:
            reason = ' '.join(str(error).split())[:_MAX_REASON].rstrip('.') or type(error).__name__
            if isinstance(error, (MemoryError, OverflowError)):
                reason = 'it claims an impossible length'
            raise SourceError(
                f'{self._path}{where} cannot be read as a ROS {self._ros} bag ({reason}); '
                f'{self._hint()}') from error

    def _hint(self) -> str:
        if self._ros == 1:
            repair = f'rosbag reindex {self._path}'
        elif self._path.is_dir():
            repair = f'ros2 bag reindex {self._path}'
        elif self._path.suffix == '.mcap':
            repair = f'mcap recover {self._path}'
        else:
            repair = f'ros2 bag reindex {self._path.parent}'
        return f'if the recording was cut off, `{repair}` may repair it'


def _access(path: Path, ros: int) -> tuple[Callable[[Path], Any], Callable[[bytes, str], Any]]:
    """Return what opens a bag of ROS 1 or 2, and what deserialises, given bytes and type name."""
    try:
        from rosbags.typesys import get_types_from_msg, get_typestore, Stores
        if ros == 1:
            from rosbags.rosbag1 import Reader as Reader1
            store = get_typestore(Stores.ROS1_NOETIC)
            # It lacks this type.
            store.register(get_types_from_msg(
                'geometry_msgs/TransformStamped[] transforms', TF_TYPE))
            return Reader1, store.deserialize_ros1
        from rosbags.rosbag2 import Reader as Reader2
        return Reader2, get_typestore(Stores.ROS2_JAZZY).deserialize_cdr
    except ImportError as error:
        if ros == 2 and find_spec('rosbag2_py') is not None:
            return rosbag2_reader.opened, rosbag2_reader.deserialise
        raise rosbags_missing('reading bags', error, instead=(
            ', or source a ROS that has rosbag2_py (bags of ROS 2 only)')) from error


def _topics_of(connections: Iterable[Connection]) -> list[Connection]:
    """Merge the connections by topic (a topic has one per publisher, maybe of several types)."""
    counts: Counter[tuple[str, str]] = Counter()
    for connection in connections:
        counts[connection.topic, connection.msgtype] += connection.msgcount
    return [Connection(name, msgtype, count) for (name, msgtype), count in sorted(counts.items())]


def _choose_topic(path: Path, topics: list[Connection], wanted: str | None) -> Connection:
    """Return the requested image topic, or the only one."""
    images = [each for each in topics if each.msgtype in IMAGE_TYPES]
    if not images:
        raise SourceError(f'{path} has no image topic; it has {_listed(topics)}')
    if wanted is not None:
        for each in images:
            if each.topic in (wanted, f'/{wanted}'):
                return each
        raise SourceError(
            f'{path} has no image topic {wanted}; its image topics are {_listed(images)}')
    # Recorders also store topics on which no message arrived.
    filled = [each for each in images if each.msgcount > 0] or images
    if len(filled) > 1:
        raise SourceError(
            f'{path} has several image topics: {_listed(filled)}; give one as the topic')
    return filled[0]


def _listed(topics: list[Connection], *, none: str = 'no topics at all') -> str:
    names = [' '.join(str(each).split()) for each in topics[:_MAX_LISTED_TOPICS]]
    if len(topics) > _MAX_LISTED_TOPICS:
        names.append(f'and {len(topics) - _MAX_LISTED_TOPICS} more')
    return ', '.join(names) or none
