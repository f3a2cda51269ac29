# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The heartbeat (bond) by which the lifecycle manager of nav2 sees that a node works."""

from collections.abc import Callable
from importlib import import_module
import uuid

from phase_traj_ros.ros.entities import Entities
from rclpy.node import Node

_TOPIC = 'bond'
# nav2's manager waits for 2 s at the start, and then for 4 s, if it is not told otherwise.
_PERIOD_S, _TIMEOUT_S = 0.2, 4.0


def keep_bond(node: Node) -> Callable[[], None]:
    """
    Send a heartbeat on ``bond`` until the function that is returned is called.

    It comes from the executor, so that it stops where the node hangs. Its type is that of the
    package bond, on which nav2 depends. Where that is not installed, nothing is sent.
    """
    try:
        status = import_module('bond.msg').Status
    except ImportError:
        return lambda: None
    entities, instance = Entities(node), str(uuid.uuid4())
    publisher = entities.create_publisher(status, _TOPIC, 1)

    def send(*, active: bool = True) -> None:
        message = status(
            id=node.get_name(), instance_id=instance, active=active,
            heartbeat_timeout=_TIMEOUT_S, heartbeat_period=_PERIOD_S)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    def end() -> None:
        send(active=False)
        entities.destroy()

    entities.create_timer(_PERIOD_S, send)
    send()
    return end
