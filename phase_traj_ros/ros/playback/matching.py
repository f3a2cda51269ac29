# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Waits until the subscribers of a topic have discovered its publisher.

A publisher may discover a subscriber before the subscriber discovers the publisher. Messages
published in between are lost. Discovery announces the endpoints of a node in the order in which
they were made, and a node can only respond to a client that it knows. The response to a client
that was made after the publisher therefore proves that the publisher is known. Nearly every node
has parameter services.
"""

from threading import Event
import time

from phase_traj_ros.ros.graph import full_name
from rcl_interfaces.srv import GetParameterTypes
from rclpy.node import Node

_ASKED = 6
_ASK_AGAIN_S = 0.5
# For subscribers without services, such as ros2 topic echo; discovery takes some tenths of it.
_SETTLE_S = 1.0


def wait_until_known(node: Node, topic: str, stop: Event) -> None:
    """
    Return when all subscribers of ``topic`` know the current endpoints of ``node``.

    Another thread has to spin the node.
    """
    subscribers = {full_name(each) for each in node.get_subscriptions_info_by_topic(topic)}
    settled = time.monotonic() + _SETTLE_S
    # A list: all subscribers are called, even if one does not respond.
    answers = [_answers(node, name, stop, settled) for name in subscribers]
    if not all(answers):
        stop.wait(max(settled - time.monotonic(), 0.0))


def _answers(node: Node, name: str, stop: Event, settled: float) -> bool:
    """Return whether a node of this name is discovered until ``settled``, and responds."""
    client = node.create_client(GetParameterTypes, f'{name}/get_parameter_types')
    try:
        if not client.wait_for_service(max(settled - time.monotonic(), 0.0)):
            return False
        for _ in range(_ASKED):
            # A response is lost if the node receives the request before it discovers the client.
            request = GetParameterTypes.Request()
            if client.call(request, timeout_sec=_ASK_AGAIN_S) is not None:
                return True
            if stop.is_set():
                break
        return False
    finally:
        node.destroy_client(client)
