# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Explains from the ROS graph why no image arrives."""


from phase_traj_ros.io.messages.topics import DEBUG_IMAGE
from rclpy.node import Node
from rclpy.qos import qos_check_compatible, QoSCompatibility, QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo

RAW = 'sensor_msgs/msg/Image'
COMPRESSED = 'sensor_msgs/msg/CompressedImage'
SUFFIX = '/compressed'
"""What image_transport appends to the name of an image topic."""


def full_name(endpoint: TopicEndpointInfo) -> str:
    """Return the full name of the node to which an endpoint belongs."""
    return f'{endpoint.node_namespace.rstrip("/")}/{endpoint.node_name}'


def image_topics(node: Node) -> dict[str, str]:
    """Return the types of the topics on which cameras publish images, by full names."""
    names = (
        name for name, kinds in sorted(node.get_topic_names_and_types())
        if {RAW, COMPRESSED} & set(kinds) and not name.endswith(f'/{DEBUG_IMAGE.name}'))
    # Types of publishers: a subscriber may expect another one.
    return {
        name: publisher.topic_type for name in names
        for publisher in node.get_publishers_info_by_topic(name)
        if publisher.topic_type in (RAW, COMPRESSED)}


def why_silent(node: Node, topic: str, message_type: str, qos: QoSProfile) -> str:
    """
    Return who publishes on an image topic, and why it does not arrive or where images are.

    Parameters
    ----------
    node
        Node that subscribes to ``topic``.
    topic
        Full name of the image topic.
    message_type
        Type of the subscription.
    qos
        Quality of service of the subscription.

    """
    publishers = node.get_publishers_info_by_topic(topic)
    text = f'{topic} has {len(publishers)} publisher{"" if len(publishers) == 1 else "s"}'
    if not publishers:
        return f'{text}; {elsewhere(topic, message_type, image_topics(node))}'
    for publisher in publishers:
        name = full_name(publisher)
        if publisher.topic_type != message_type:
            text += (f'; {name} publishes {publisher.topic_type}, this node expects {message_type}'
                     ' (see the parameter image_transport)')
            continue
        compatibility, reason = qos_check_compatible(publisher.qos_profile, qos)
        if compatibility == QoSCompatibility.ERROR:
            text += f'; the quality of service of {name} does not match: {_plain(reason)}'
    return text


def elsewhere(topic: str, message_type: str, topics: dict[str, str]) -> str:
    """Return where images are instead of on ``topic``, and how to receive them."""
    if not topics:
        return 'no node publishes images'
    named = [name for name, kind in topics.items() if kind == message_type] or list(topics)
    counterpart = topic + SUFFIX if message_type == RAW else topic.removesuffix(SUFFIX)
    if topics.get(counterpart, message_type) != message_type:
        named = [counterpart]
    base, transport = named[0], 'raw'
    if topics[base] == COMPRESSED:
        base, transport = base.removesuffix(SUFFIX), 'compressed'
    return (f'images are on {", ".join(named)}: remap image, as in -r image:={base}, with'
            f' image_transport {transport}')


def _plain(reason: str) -> str:
    """Return the reasons of the middleware without its shouting and punctuation."""
    return reason.strip().rstrip(';').removeprefix('ERROR: ').replace(';ERROR: ', ', ')
