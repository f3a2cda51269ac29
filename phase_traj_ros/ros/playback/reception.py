# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Counts the played frames that the nodes of this package have received."""

from threading import Event
import time

from diagnostic_msgs.msg import DiagnosticArray
from phase_traj_ros.ros.graph import full_name
import rclpy
from rclpy.node import Node

# The node reports once a second.
_REPORT_S = 1.5
_POLL_S = 0.1


class Reception:
    """Reads the image counts of nodes on one image topic from /diagnostics."""

    def __init__(self, node: Node, topic: str) -> None:
        """Subscribe to /diagnostics on ``node``; ``topic`` is the full name of the image topic."""
        self._node = node
        self._topic = topic
        self._images: dict[str, int] = {}
        self._before: dict[str, int] = {}
        self._subscription = node.create_subscription(
            DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)

    def begin(self, stop: Event) -> None:
        """Record the current counts of the nodes, after each has reported once."""
        deadline = time.monotonic() + _REPORT_S
        while (self._telling() - set(self._images) and not stop.is_set()
                and time.monotonic() < deadline):
            rclpy.spin_once(self._node, timeout_sec=_POLL_S)
        self._before = dict(self._images)

    def missed(self, published: int, stop: Event) -> dict[str, int]:
        """Return the nodes that received fewer than ``published`` images, and their counts."""
        deadline = time.monotonic() + 2 * _REPORT_S
        while (short := self._short_of(published)) and time.monotonic() < deadline:
            if stop.is_set():
                return {}
            rclpy.spin_once(self._node, timeout_sec=_POLL_S)
        return short

    def _short_of(self, published: int) -> dict[str, int]:
        got = {name: self._images[name] - before for name, before in self._before.items()}
        return {name: count for name, count in got.items() if 0 <= count < published}

    def _telling(self) -> set[str]:
        """Return the subscribers of the images that publish diagnostics."""
        subscribers = self._node.get_subscriptions_info_by_topic(self._topic)
        publishers = self._node.get_publishers_info_by_topic('/diagnostics')
        return set(map(full_name, subscribers)) & set(map(full_name, publishers))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            name, _, what = status.name.rpartition(': ')
            if status.hardware_id == self._topic and what == 'images':
                values = {each.key: each.value for each in status.values}
                if values.get('images', '').isdecimal():
                    self._images[name] = int(values['images'])
