# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a bag with all messages that the node would have published."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, ExitStack
from pathlib import Path
import statistics
from tempfile import TemporaryDirectory
from typing import Any

from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.errors import OutputError, rosbags_missing
from phase_traj_ros.io.messages.diagnostics import Level, MeasurementReporter, Report
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.messages.published import Messages
from phase_traj_ros.io.messages.schedule import DIAGNOSTICS_PERIOD_NS, Pace, Schedule
from phase_traj_ros.io.messages.stamps import STAMPS_END_NS
from phase_traj_ros.io.messages.topics import DEBUG_IMAGE, pair_topics, Topic, whole_topics
from phase_traj_ros.io.replay.run import Watcher
from phase_traj_ros.io.results.pictures import draw
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import NODE_NAME

SUFFIX = '.mcap'
DIAGNOSTICS = '/diagnostics'

_DIAGNOSTICS = Topic('diagnostics', 'diagnostic_msgs/msg/DiagnosticArray')
_RESPONSES = 1000
# rosbag2 cannot store a sign.
_STAMPS_NS = range(STAMPS_END_NS)


def topic_name(topic: Topic) -> str:
    """Return the full name of a topic of a node in the root namespace."""
    return f'/{NODE_NAME}/{topic.name}'


class BagSink(Watcher, AbstractContextManager['BagSink']):
    """
    Writes the topics of the node as the node would publish them, by the stamps of the images.

    The node uses the wall clock for the rates of the path, the chain code text and the
    diagnostics; the bag uses the stamps, and delayed messages are written at the end. Header
    stamps and log times are those of the images. If the stamps restart, the bag starts again, as
    do the other results.

    As a context manager, it completes the bag on exit and deletes it after an exception.
    """

    def __init__(
        self, path: Path, mounting: Mounting, *, source: str, debug_images: bool = False,
    ) -> None:
        """
        Make a sink that writes the single file ``path``, whose name ends in .mcap.

        ``source`` is the replayed source, the hardware id of the diagnostics. ``debug_images``
        adds the debug image of every pair, which makes the bag large.

        Raises
        ------
        MissingDependencyError
            rosbags is not installed, or its version cannot write MCAP files.

        """
        self._types = _types()
        self._messages = Messages(self._types.types)
        self._target = path
        self._mounting = mounting
        self._parameters = mounting.parameters
        # The name of a file need not be UTF-8, but a text in a message is.
        self._source = source.encode(errors='backslashreplace').decode()
        self._debug_images = debug_images
        self._bag = ExitStack()

    def __exit__(self, kind: type[BaseException] | None, *error: Any) -> None:
        if kind is not None:
            self._bag.__exit__(kind, *error)
            return
        with self._bag:
            last_ns = self._estimator.last_stamp_ns or 0
            self._write_whole(self._schedule.take(last_ns, rest=True), last_ns)
            if self._diagnosed.pending:
                self._write_diagnostics(last_ns)

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start a bag; it replaces the one before."""
        self._bag.close()
        topics = [
            *pair_topics(self._parameters), *whole_topics(self._parameters),
            *([DEBUG_IMAGE] if self._debug_images else [])]
        self._write = self._bag.enter_context(_bag(self._target, self._types, {
            **{topic_name(topic): topic for topic in topics}, DIAGNOSTICS: _DIAGNOSTICS}))
        self._estimator = estimator
        self._schedule = Schedule(self._parameters)
        self._diagnosed = Pace(DIAGNOSTICS_PERIOD_NS)
        self._diagnosed.sent(frame.stamp_ns)
        self._responses: deque[float] = deque(maxlen=_RESPONSES)
        self._measured = MeasurementReporter()
        # Counts from before the start do not belong to this bag.
        self._measured.skip(estimator)

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """
        Write the messages of a pair.

        Raises
        ------
        OutputError
            The bag cannot hold the stamp.

        """
        update = self._mounting.at_base(update)
        stamp_ns = update.stamp_ns
        if stamp_ns not in _STAMPS_NS:
            raise OutputError(
                f'a bag cannot hold the stamp {stamp_ns / 1e9:.9f} s: stamps must be from'
                ' 0 to 2**31 seconds; write no bag')
        for topic, message in self._messages.of_pair(
                update, self._parameters, camera_frame=frame.frame_id):
            self._write(f'/{NODE_NAME}/{topic}', stamp_ns, message)
        if update.shift is not None:
            self._responses.append(update.shift.response)
        self._schedule.add(update)
        self._write_whole(self._schedule.take(stamp_ns), stamp_ns)
        self._diagnosed.changed()
        if self._diagnosed.is_due(stamp_ns):
            self._write_diagnostics(stamp_ns)
        if self._debug_images:
            header = self._messages.header(stamp_ns, frame.frame_id)
            self._write(topic_name(DEBUG_IMAGE), stamp_ns, self._messages.image(
                draw(frame, update, estimator), header))

    def _write_whole(self, topics: Iterable[Topic], stamp_ns: int) -> None:
        for topic in topics:
            self._write(topic_name(topic), stamp_ns, self._messages.of_all(
                topic, self._estimator, self._parameters))

    def _write_diagnostics(self, stamp_ns: int) -> None:
        response = statistics.median(self._responses or [0.0])
        images = Report(Level.OK, 'receiving images', {
            'topic': self._source, 'images': str(self._estimator.counters.frames)})
        measured = self._measured.report(self._estimator, response)
        self._write(DIAGNOSTICS, stamp_ns, self._messages.diagnostics(
            {'images': images, 'measurement': measured}, node=f'/{NODE_NAME}',
            hardware_id=self._source, stamp=self._messages.time(stamp_ns)))
        self._diagnosed.sent(stamp_ns)


@contextmanager
def _bag(
    target: Path, types: Any, topics: Mapping[str, Topic],
) -> Iterator[Callable[[str, int, Any], None]]:
    """Yield a function that writes a message, with its topic and stamp, to a bag of one file."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    # rosbags makes a directory, and a file of the same name in it. Only the file is kept: it is
    # complete without the metadata of the directory.
    with TemporaryDirectory(dir=target.parent) as parts:
        directory = Path(parts) / target.stem
        writer = Writer(directory, version=9, storage_plugin=StoragePlugin.MCAP)
        # Consecutive paths are nearly equal, so compression is effective.
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            connections = {
                name: writer.add_connection(
                    name, topic.type, typestore=types,
                    offered_qos_profiles=[_qos(latched=topic.latched)])
                for name, topic in topics.items()}

            def write(topic: str, stamp_ns: int, message: Any) -> None:
                data = types.serialize_cdr(message, message.__msgtype__)
                writer.write(connections[topic], stamp_ns, data)

            yield write
        (directory / target.name).replace(target)


def _types() -> Any:
    try:
        from rosbags.rosbag2 import CompressionMode, StoragePlugin  # noqa: F401
        from rosbags.typesys import get_typestore, Stores
    except ImportError as error:
        raise rosbags_missing('writing bags', error, instead=', or write no bag') from None
    return get_typestore(Stores.ROS2_JAZZY)


def _qos(*, latched: bool) -> Any:
    """Return the quality of service of the node, so that ros2 bag play offers the same."""
    from rosbags import interfaces
    endless = interfaces.QosTime(9_223_372_036, 854_775_807)
    return interfaces.Qos(
        history=interfaces.QosHistory.KEEP_LAST, depth=1 if latched else 100,
        reliability=interfaces.QosReliability.RELIABLE,
        durability=(
            interfaces.QosDurability.TRANSIENT_LOCAL if latched
            else interfaces.QosDurability.VOLATILE),
        deadline=endless, lifespan=endless, liveliness=interfaces.QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=endless, avoid_ros_namespace_conventions=False)
