# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entities of a node that are destroyed together."""

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from copy import copy
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer

PER_PAIR = QoSProfile(depth=100)
"""Reliable. A subscriber may lag by a few seconds without losing a message of a pair."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""A late subscriber receives the last message at once."""


class Entities(AbstractContextManager['Entities']):
    """
    Makes publishers, subscriptions, services and timers on a node, and destroys exactly these.

    A managed node makes them when it is configured or activated, and destroys them later. As a
    context manager, it destroys them if the block fails. Publishers and subscriptions accept
    ``qos_overrides``. rclpy writes these into the profile it is given: each gets a copy.
    """

    def __init__(self, node: Node) -> None:
        """Own nothing yet."""
        self._node = node
        self._made = ExitStack()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Destroy the entities if the block has failed."""
        if kind is not None:
            self.destroy()

    def destroy(self) -> None:
        """Destroy the entities, the newest first; more can be made afterwards."""
        self._made.close()

    def create_publisher(self, kind: Any, topic: str, qos: QoSProfile | int) -> Publisher:
        """
        Make a publisher as ``Node.create_publisher`` does, but without the default callbacks.

        They would add two entities per topic that rclpy checks at each wait.
        """
        made = self._node.create_publisher(
            kind, topic, copy(qos),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False))
        self._made.callback(self._node.destroy_publisher, made)
        return made

    def create_subscription(
        self, kind: Any, topic: str, callback: Callable[..., None],
        qos: QoSProfile | int,
    ) -> Subscription:
        """Make a subscription as ``Node.create_subscription`` does."""
        made = self._node.create_subscription(
            kind, topic, callback, copy(qos),
            qos_overriding_options=QoSOverridingOptions.with_default_policies())
        self._made.callback(self._node.destroy_subscription, made)
        return made

    def create_service(self, *args: Any, **options: Any) -> Service:
        """Make a service as ``Node.create_service`` does."""
        made = self._node.create_service(*args, **options)
        self._made.callback(self._node.destroy_service, made)
        return made

    def create_timer(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Make a timer with a steady clock: it goes on while simulated time is paused."""
        made = self._node.create_timer(
            period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._made.callback(self._node.destroy_timer, made)
        return made
