# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes the state of the node on /diagnostics, and warns when no image arrives."""

from collections.abc import Callable
import os
import time

from diagnostic_msgs.msg import DiagnosticArray
from phase_traj_ros.core import TrajectoryEstimator
from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.io.messages.diagnostics import Level, MeasurementReporter, Report
from phase_traj_ros.io.messages.schedule import DIAGNOSTICS_PERIOD_NS
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.graph import full_name, why_silent
from phase_traj_ros.ros.health import advice, Health, Stage
from phase_traj_ros.ros.inputs.image import ImageInput
from phase_traj_ros.ros.outputs.messages import MESSAGES
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from rclpy.utilities import get_rmw_implementation_identifier

_SILENCE_NS = 5 * 10**9
_THROTTLE_S = 60.0


class Diagnostics:
    """
    Reports once a second.

    There are two statuses, and one more with a map: whether usable images arrive, whether their
    shift can be measured, and whether the place is known.
    docs/reference/diagnostics.md explains them.
    """

    def __init__(
        self, node: Node, entities: Entities, health: Health, image_input: ImageInput,
        estimator: TrajectoryEstimator, location: Callable[[], Report] | None = None,
    ) -> None:
        """Start reporting on ``node``; ``location`` returns the status of the place on a map."""
        self._location = location
        self._node = node
        self._health = health
        self._input = image_input
        self._estimator = estimator
        self._publisher = entities.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._since_ns = time.monotonic_ns()
        self._warned = False
        self._several = ''
        self._said: dict[str, str] = {}
        self._measured = MeasurementReporter()
        self._measured.skip(estimator)
        entities.create_timer(DIAGNOSTICS_PERIOD_NS / 1e9, self._report)

    def _report(self) -> None:
        self._watch_silence()
        self._watch_publishers()
        frozen = Reason.FROZEN in self._estimator.reliability.reasons
        self._warn_once('repeats', Reason.FROZEN.sentence if frozen else '')
        bad, lost = self._health.take_faults()
        if lost:
            self._warn_of_losses(lost)
        # Computing the medians takes time.
        if self._publisher.get_subscription_count():
            self._publish(bad, lost)
        else:
            self._measured.skip(self._estimator)
        logger = self._node.get_logger()
        if logger.is_enabled_for(LoggingSeverity.DEBUG):
            logger.debug('microseconds per image: ' + ', '.join(
                f'{stage.value} {self._health.microseconds(stage):.0f}' for stage in Stage))

    def _publish(self, bad: int, lost: int) -> None:
        self._publisher.publish(MESSAGES.diagnostics(
            {'images': self._images(bad, lost),
             'measurement': self._measured.report(self._estimator, self._health.response()),
             **({} if self._location is None else {'location': self._location()})},
            node=self._node.get_fully_qualified_name(), hardware_id=self._input.topic,
            stamp=self._node.get_clock().now().to_msg()))

    def _watch_silence(self) -> None:
        arrival = self._health.last_arrival_ns
        silent_ns = time.monotonic_ns() - max(self._since_ns, arrival or 0)
        if silent_ns < _SILENCE_NS:
            self._warned = False
        elif not self._warned:
            self._warned = True
            self._node.get_logger().warning(
                f'no image for {silent_ns / 1e9:.0f} s: ' + why_silent(
                    self._node, self._input.topic, self._input.message_type,
                    self._input.qos_profile))

    def _watch_publishers(self) -> None:
        """Warn when several nodes publish on the image topic: their images would be mixed."""
        topic = self._input.topic
        names = sorted(map(full_name, self._node.get_publishers_info_by_topic(topic)))
        self._several = ''
        if len(names) > 1:
            self._several = f'{len(names)} publishers: {", ".join(names)}'
        self._warn_once('publishers', self._several and (
            f'{topic} has {self._several}: pairs are wrong where their images alternate; give each'
            ' camera its own topic' + (
                ' (or ignore this: a node that has crashed and was started again is listed twice'
                ' for up to 20 s)' if len(set(names)) == 1 else '')))

    def _warn_once(self, about: str, text: str) -> None:
        """Log a warning, unless it was the last one about this; an empty text ends it."""
        if text and text != self._said.get(about):
            self._node.get_logger().warning(text)
        self._said[about] = text

    def _images(self, bad: int, lost: int) -> Report:
        health = self._health
        now_ns = time.monotonic_ns()
        if self._warned:
            level, message = Level.STALE, 'no images'
        elif bad:
            level, message = Level.ERROR, f'{bad} images could not be used'
        elif self._several:
            level, message = Level.WARN, self._several
        elif lost:
            level, message = Level.WARN, f'{lost} images were lost'
        elif not health.images:
            level, message = Level.OK, 'waiting for the first image'
        else:
            level, message = Level.OK, 'receiving images'
        return Report(level, message, {
            'topic': self._input.topic,
            'rate (Hz)': f'{0.0 if self._warned else health.rate(now_ns):.1f}',
            'images': str(health.images),
            'lost': str(health.lost),
            'bad': str(health.bad),
            'last error': health.last_error,
            'p50 (ms)': f'{health.milliseconds(0.5):.2f}',
            'p99 (ms)': f'{health.milliseconds(0.99):.2f}',
            **{f'{stage.value} (us)': f'{health.microseconds(stage):.0f}' for stage in Stage},
        })

    def _warn_of_losses(self, lost: int) -> None:
        what = advice(self._health.image_bytes, get_rmw_implementation_identifier(), os.environ)
        self._node.get_logger().warning(
            f'{lost} images on {self._input.topic} were lost within the last second: {what}',
            throttle_duration_sec=_THROTTLE_S)
