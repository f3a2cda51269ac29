# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entities of a node that are destroyed together."""

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node


class Made:
    """
    Tracks the publishers, subscriptions, services and timers made on a node within the block.

    A managed node makes them when it is configured or activated, and destroys them later.
    """

    def __init__(self, node: Node) -> None:
        """Track nothing yet."""
        self._node = node
        self._before: set[Any] = set()

    def __enter__(self) -> None:
        """Begin to track."""
        self._before = self._all()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """End; destroy the entities if the block has failed."""
        if kind is not None:
            self.destroy()

    def destroy(self) -> None:
        """Destroy the entities made since the block began."""
        node = self._node
        destroyers: tuple[tuple[Iterable[Any], Callable[[Any], object]], ...] = (
            (node.subscriptions, node.destroy_subscription),
            (node.timers, node.destroy_timer),
            (node.services, node.destroy_service),
            (node.publishers, node.destroy_publisher))
        for entities, destroy in destroyers:
            for entity in [each for each in entities if each not in self._before]:
                destroy(entity)

    def _all(self) -> set[Any]:
        node = self._node
        return {*node.subscriptions, *node.timers, *node.services, *node.publishers}
