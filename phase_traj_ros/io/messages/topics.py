# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The topics that the node publishes."""

from dataclasses import dataclass

from phase_traj_ros.parameters import Parameters


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that the node publishes; its name is relative to that of the node."""

    name: str
    type: str  # noqa: A003
    latched: bool = False
    """Whether late subscribers receive the last message at once."""


ALWAYS = (
    Topic('movement', 'std_msgs/msg/UInt8'),
    Topic('direction', 'std_msgs/msg/UInt8'),
    Topic('shift', 'geometry_msgs/msg/Vector3Stamped'),
    Topic('response', 'std_msgs/msg/Float32'),
    Topic('status', 'std_msgs/msg/String'),
    Topic('pose', 'geometry_msgs/msg/PoseStamped'),
    Topic('pair', 'diagnostic_msgs/msg/DiagnosticArray'),
)
"""Topics of ``Messages.of_pair``."""

HEADING = (
    Topic('heading', 'std_msgs/msg/Float64'),
    Topic('heading_stamped', 'geometry_msgs/msg/QuaternionStamped'),
    Topic('turn', 'geometry_msgs/msg/Vector3Stamped'),
    Topic('camera', 'std_msgs/msg/String', latched=True),
)
"""Additional topics of ``Messages.of_pair`` if the heading is measured."""

ODOMETRY = Topic('odom', 'nav_msgs/msg/Odometry')
POSE_WITH_COVARIANCE = Topic(
    'pose_with_covariance', 'geometry_msgs/msg/PoseWithCovarianceStamped')
SPEED = Topic('speed', 'geometry_msgs/msg/TwistWithCovarianceStamped')
"""Additional topics of ``Messages.of_pair`` if the distance is in metres."""

CHAIN_CODE = Topic('chain_code', 'std_msgs/msg/String', latched=True)
LINKS = Topic('links', 'std_msgs/msg/String', latched=True)
PATH = Topic('path', 'nav_msgs/msg/Path', latched=True)
DEBUG_IMAGE = Topic('debug_image', 'sensor_msgs/msg/Image')


def pair_topics(parameters: Parameters) -> tuple[Topic, ...]:
    """Return the topics of ``Messages.of_pair`` for these parameters."""
    settings = parameters.settings
    metric = (ODOMETRY, POSE_WITH_COVARIANCE, SPEED) if settings.metric else ()
    return (*ALWAYS, *(HEADING if settings.measures_heading else ()), *metric)


def whole_topics(parameters: Parameters) -> tuple[Topic, ...]:
    """Return the topics of ``Messages.of_all`` for these parameters."""
    return (CHAIN_CODE, PATH, LINKS) if parameters.code_step > 0 else (CHAIN_CODE, PATH)
