# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Waits until those who subscribe to a topic know who publishes on it.

A publisher that has found its subscriber may not have been found by it: what is published then is
lost. Discovery announces the endpoints of a node in the order in which they were made, and a node
can only answer a client that it knows. So the answer to a client that is made after the publisher
proves that the publisher is known. Nearly every node answers questions about its parameters.
"""

from threading import Event
import time

from rcl_interfaces.srv import GetParameterTypes
import rclpy
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

_ANSWER_S = 3.0
_ASK_AGAIN_S = 0.5
_POLL_S = 0.02
# For those that cannot be asked, such as ros2 topic echo; discovery takes some tenths of it.
_SETTLE_S = 1.0


def wait_until_known(node: Node, topic: str, stop: Event) -> None:
    """Return when all subscribers of ``topic`` know the endpoints that ``node`` has by now."""
    subscribers = {
        full_name(each) for each in node.get_subscriptions_info_by_topic(topic)}
    # All are asked, also once one of them has not answered.
    answers = [_answers(node, name, stop) for name in subscribers]
    if not all(answers):
        stop.wait(_SETTLE_S)


def full_name(endpoint: TopicEndpointInfo) -> str:
    """Return the name of the node, with its namespace, that an endpoint belongs to."""
    return f'{endpoint.node_namespace.rstrip("/")}/{endpoint.node_name}'


def _answers(node: Node, name: str, stop: Event) -> bool:
    """Tell whether the node of that name, which may be none, answers."""
    namespace, _, own = name.rpartition('/')
    if (own, namespace or '/') not in node.get_node_names_and_namespaces():
        return False
    services = dict(node.get_service_names_and_types_by_node(own, namespace or '/'))
    if f'{name}/get_parameter_types' not in services:
        return False
    client = node.create_client(GetParameterTypes, f'{name}/get_parameter_types')
    deadline = time.monotonic() + _ANSWER_S
    try:
        while not stop.is_set() and time.monotonic() < deadline:
            if not client.service_is_ready():
                stop.wait(_POLL_S)
                continue
            # An answer is lost where the node sees the call before it sees who calls.
            answer = client.call_async(GetParameterTypes.Request())
            rclpy.spin_until_future_complete(node, answer, timeout_sec=_ASK_AGAIN_S)
            if answer.done():
                return True
            client.remove_pending_request(answer)
        return False
    finally:
        node.destroy_client(client)
