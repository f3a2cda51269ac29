# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is made on a node, to be taken down together."""

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node


class Made:
    """
    Remembers what is made on a node within the block: publishers, subscriptions, services, timers.

    A managed node makes them when it is configured or activated, and takes them down again.
    """

    def __init__(self, node: Node) -> None:
        """Remember nothing yet."""
        self._node = node
        self._before: set[Any] = set()

    def __enter__(self) -> None:
        """Begin."""
        self._before = self._all()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """End; take everything down again where the block has failed."""
        if kind is not None:
            self.destroy()

    def destroy(self) -> None:
        """Take down what was made since the block began."""
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
