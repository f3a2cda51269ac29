# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag of everything the node would have published about a replay."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from pathlib import Path
import shutil
import statistics
from typing import Any, Final, TYPE_CHECKING

from phase_traj_ros.core import Movement, TrajectoryEstimator, Update
from phase_traj_ros.errors import MissingDependencyError, OutputError
from phase_traj_ros.io.debug_picture import draw
from phase_traj_ros.io.measurement_report import Level, MeasurementReporter, Report
from phase_traj_ros.io.messages import (
    CHAIN_CODE,
    CHAIN_CODE_PERIOD_NS,
    DEBUG_IMAGE,
    Messages,
    PATH,
    path_points,
    PER_PAIR,
    Topic,
)
from phase_traj_ros.io.pacing import Pace
from phase_traj_ros.io.source import Frame
from phase_traj_ros.parameters import NODE_NAME, Parameters

if TYPE_CHECKING:
    from rosbags.interfaces import Connection, Qos
    from rosbags.rosbag2 import Writer

SUFFIX: Final = '.mcap'
DIAGNOSTICS: Final = '/diagnostics'

_DIAGNOSTICS_TYPE = 'diagnostic_msgs/msg/DiagnosticArray'
_DIAGNOSTICS_PERIOD_NS = 10**9
_RESPONSES = 1000
# builtin_interfaces/Time counts seconds in 32 bits, with a sign that rosbag2 cannot store.
_STAMPS_NS = range(2**31 * 10**9)


def topic_name(topic: Topic) -> str:
    """Return the full name of a topic of a node in the root namespace."""
    return f'/{NODE_NAME}/{topic.name}'


class BagSink:
    """
    Writes the node's topics as it would publish them, by the stamps of the images.

    What the node does by the clock on the wall (the path's rate, the chain code's text and the
    diagnostics once a second) is done by the stamps, and all that is pending goes out at the end.
    Header stamps and log times are those of the images. Where the stamps go back, the bag starts
    anew, as the other results do.

    A context manager: the bag is complete when it is left, and gone if that is by an exception.
    """

    def __init__(
        self, path: Path, parameters: Parameters, *, source: str, debug_images: bool = False,
    ) -> None:
        """
        Make a sink that will write the single file ``path``.

        Parameters
        ----------
        path
            A file that does not exist yet, with the suffix .mcap.
        parameters
            Those of the replay.
        source
            What is replayed; the diagnostics name it as their hardware.
        debug_images
            Whether to write the debug image of every pair, too; it makes large bags.

        Raises
        ------
        MissingDependencyError
            rosbags is not installed, or one that cannot write MCAP files.

        """
        self._types = _types()
        self._messages = Messages(self._types.types)
        self._target = path
        self._parameters = parameters
        self._source = source
        self._debug_images = debug_images
        self._writer: Writer | None = None
        self._connections: dict[str, Connection] = {}
        self._estimator: TrajectoryEstimator | None = None
        self._forget()

    def __enter__(self) -> BagSink:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._complete()
        else:
            self._discard()

    def start(self, frame: Frame, estimator: TrajectoryEstimator) -> None:
        """Begin a bag, in the place of the one begun before."""
        self._discard()
        self._forget()
        self._estimator = estimator
        # Counts of what came before the start belong to no second of this bag.
        self._measured.report(estimator.counters, 0.0)
        self._diagnosed.sent(frame.stamp_ns)
        self._open()

    def add(self, frame: Frame, update: Update, estimator: TrajectoryEstimator) -> None:
        """
        Write what a pair adds.

        Raises
        ------
        OutputError
            The bag cannot be written, or cannot hold the stamp.

        """
        stamp_ns = update.stamp_ns
        if stamp_ns not in _STAMPS_NS:
            raise OutputError(
                f'a bag cannot hold the stamp {stamp_ns / 1e9:.9f} s: it takes those from 0 to'
                ' 2**31 seconds; leave out --bag-out')
        for topic, message in self._messages.of_pair(update, self._parameters):
            self._write(f'/{NODE_NAME}/{topic}', stamp_ns, message)
        if self._debug_images:
            self._write(topic_name(DEBUG_IMAGE), stamp_ns, self._picture(frame, update, estimator))
        if update.shift is not None:
            self._responses.append(update.shift.response)
        for pace in (self._text, self._path, self._diagnosed):
            pace.changed()
        if update.step.movement is not self._last_movement or self._text.is_due(stamp_ns):
            self._last_movement = update.step.movement
            self._write_text(estimator, stamp_ns)
        if self._path.is_due(stamp_ns):
            self._write_path(estimator, stamp_ns)
        if self._diagnosed.is_due(stamp_ns):
            self._write_diagnostics(estimator, stamp_ns)

    def _forget(self) -> None:
        self._last_movement: Movement | None = None
        self._text = Pace(CHAIN_CODE_PERIOD_NS)
        self._path = Pace(round(1e9 / self._parameters.path_rate))
        self._diagnosed = Pace(_DIAGNOSTICS_PERIOD_NS)
        self._measured = MeasurementReporter()
        self._responses: deque[float] = deque(maxlen=_RESPONSES)

    def _complete(self) -> None:
        estimator = self._estimator
        if self._writer is None or estimator is None or estimator.last_stamp_ns is None:
            return
        last_ns = estimator.last_stamp_ns
        if self._text.pending:
            self._write_text(estimator, last_ns)
        if self._path.pending:
            self._write_path(estimator, last_ns)
        if self._diagnosed.pending:
            self._write_diagnostics(estimator, last_ns)
        writer, self._writer = self._writer, None
        writer.close()
        # Of the bag's directory only the file is wanted: it is complete in itself.
        (self._directory / self._target.name).replace(self._target)
        shutil.rmtree(self._directory.parent)

    def _discard(self) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):
                writer.close()
        shutil.rmtree(self._directory.parent, ignore_errors=True)

    @property
    def _directory(self) -> Path:
        # rosbags names the file after its directory.
        return self._target.parent / f'.{self._target.name}.parts' / self._target.stem

    def _open(self) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer
        self._writer = Writer(
            self._directory, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        topics = [*PER_PAIR, CHAIN_CODE, PATH, *([DEBUG_IMAGE] if self._debug_images else [])]
        for topic in topics:
            self._connect(topic_name(topic), topic.type, latched=topic.latched)
        self._connect(DIAGNOSTICS, _DIAGNOSTICS_TYPE, latched=False)

    def _connect(self, topic: str, kind: str, *, latched: bool) -> None:
        assert self._writer is not None
        self._connections[topic] = self._writer.add_connection(
            topic, kind, typestore=self._types, offered_qos_profiles=[_qos(latched=latched)])

    def _write(self, topic: str, stamp_ns: int, message: Any) -> None:
        assert self._writer is not None
        data = self._types.serialize_cdr(message, message.__msgtype__)
        self._writer.write(self._connections[topic], stamp_ns, data)

    def _write_text(self, estimator: TrajectoryEstimator, stamp_ns: int) -> None:
        self._write(topic_name(CHAIN_CODE), stamp_ns, self._messages.chain_code(
            estimator.codes, estimator.frames, self._parameters))
        self._text.sent(stamp_ns)

    def _write_path(self, estimator: TrajectoryEstimator, stamp_ns: int) -> None:
        points = path_points(estimator.path, self._parameters.max_path_poses)
        header = self._messages.header(stamp_ns, self._parameters.frame_id)
        self._write(topic_name(PATH), stamp_ns, self._messages.path(
            points, self._parameters.step_length, header))
        self._path.sent(stamp_ns)

    def _write_diagnostics(self, estimator: TrajectoryEstimator, stamp_ns: int) -> None:
        response = statistics.median(self._responses) if self._responses else 0.0
        images = Report(Level.OK, 'images come', {
            'topic': self._source, 'images': str(estimator.counters.frames)})
        measured = self._measured.report(estimator.counters, response)
        self._write(DIAGNOSTICS, stamp_ns, self._types.types[_DIAGNOSTICS_TYPE](
            header=self._messages.header(stamp_ns, ''),
            status=[self._status('images', images), self._status('measurement', measured)]))
        self._diagnosed.sent(stamp_ns)

    def _status(self, name: str, report: Report) -> Any:
        key_value = self._types.types['diagnostic_msgs/msg/KeyValue']
        return self._types.types['diagnostic_msgs/msg/DiagnosticStatus'](
            level=int(report.level), name=f'/{NODE_NAME}: {name}', message=report.message,
            hardware_id=self._source,
            values=[key_value(key=key, value=value) for key, value in report.values.items()])

    def _picture(self, frame: Frame, update: Update, estimator: TrajectoryEstimator) -> Any:
        picture = draw(frame, update, estimator)
        height, width, _ = picture.shape
        return self._types.types['sensor_msgs/msg/Image'](
            header=self._messages.header(update.stamp_ns, self._parameters.frame_id),
            height=height, width=width, encoding='bgr8', is_bigendian=0, step=3 * width,
            data=picture.reshape(-1))


def _types() -> Any:
    try:
        from rosbags.rosbag2 import StoragePlugin  # noqa: F401
        from rosbags.typesys import get_typestore, Stores
    except ImportError as error:
        raise MissingDependencyError(
            f'writing bags needs the Python package rosbags, 0.10.9 or later ({error}): pip'
            ' install -U rosbags (in a venv on Ubuntu 24.04), or leave out --bag-out') from None
    return get_typestore(Stores.ROS2_JAZZY)


def _qos(*, latched: bool) -> Qos:
    """Return the quality of service that the node offers, for ros2 bag play to offer it, too."""
    from rosbags.interfaces import (
        Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime)
    endless = QosTime(9_223_372_036, 854_775_807)
    return Qos(
        history=QosHistory.KEEP_LAST, depth=1 if latched else 100,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        deadline=endless, lifespan=endless, liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=endless, avoid_ros_namespace_conventions=False)
