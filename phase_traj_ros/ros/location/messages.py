# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts estimates, fixes and roads between the locator and ROS messages."""

import cmath
from collections.abc import Sequence
from itertools import pairwise
import math
from typing import Any

from geometry_msgs.msg import Point, Vector3
from nav_msgs.msg import Odometry as OdometryMessage
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Candidate, LocationEstimate, Odometry, PositionFix
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.messages.published import spatial_covariance, UNKNOWN_VARIANCE
from phase_traj_ros.io.messages.stamps import to_nanoseconds
from phase_traj_ros.ros.outputs.messages import MESSAGES
from sensor_msgs.msg import NavSatFix, NavSatStatus
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

# Covariance of a fix whose receiver does not report one: standard deviations of 10 m.
_DEFAULT_COVARIANCE = np.diag([100.0] * 3).reshape(-1).tolist()
# Sizes of markers in metres.
_ROAD_WIDTH = 2.0
_CERTAIN_SIZE = 30.0
_SMALLEST_SIZE = 4.0
_GREY = ColorRGBA(r=0.6, g=0.65, b=0.7, a=1.0)
_RED = ColorRGBA(r=0.82, g=0.29, b=0.36, a=0.8)


def fix_message(
    estimate: LocationEstimate, stamp_ns: int, frame_id: str,
    projection: LocalProjection,
) -> NavSatFix:
    """Return an estimate as a NavSatFix; STATUS_NO_FIX and NaN if the place is not known."""
    message = NavSatFix(
        header=MESSAGES.header(stamp_ns, frame_id), latitude=math.nan, longitude=math.nan,
        altitude=math.nan, status=NavSatStatus(status=NavSatStatus.STATUS_NO_FIX))
    if estimate.claimed:
        message.status.status = NavSatStatus.STATUS_FIX
        latitude, longitude = projection.to_degrees(estimate.x, estimate.y)
        message.latitude, message.longitude = float(latitude), float(longitude)
        covariance = np.diag([0.0, 0.0, UNKNOWN_VARIANCE])
        covariance[:2, :2] = np.array(estimate.covariance)[:2, :2]
        message.position_covariance = covariance.reshape(-1)
        message.position_covariance_type = NavSatFix.COVARIANCE_TYPE_KNOWN
    return message


def position_fix(message: NavSatFix, projection: LocalProjection) -> PositionFix | None:
    """
    Return a NavSatFix in metres of the map; None without a position on its hemisphere.

    A fix with the stamp 0 applies to the newest pair.

    Raises
    ------
    ValueError
        The status is not set, or the covariance is not valid, see ``PositionFix``.

    """
    if message.status.status < NavSatStatus.STATUS_NO_FIX:
        raise ValueError(
            'its status is not set (STATUS_UNKNOWN): set status.status to STATUS_FIX or above')
    if message.status.status < NavSatStatus.STATUS_FIX or not (
            math.isfinite(message.latitude + message.longitude)):
        return None
    x, y = projection.to_metres(message.latitude, message.longitude).tolist()
    if not (math.isfinite(x) and math.isfinite(y)):
        return None
    covariance = message.position_covariance.tolist()
    if message.position_covariance_type == NavSatFix.COVARIANCE_TYPE_UNKNOWN:
        covariance = _DEFAULT_COVARIANCE
    return PositionFix(
        x, y, variance_x=covariance[0], variance_y=covariance[4], covariance_xy=covariance[1],
        stamp_ns=to_nanoseconds(message.header.stamp) or None)


def odometry_message(
    estimate: LocationEstimate, odometry: Odometry | None, header: Header, child_frame: str,
) -> OdometryMessage:
    """Return a known place as a nav_msgs/Odometry, with the twist of ``odometry`` if given."""
    if odometry is not None:
        message = MESSAGES.odometry(odometry, child_frame, header)
    else:
        message = OdometryMessage(header=header, child_frame_id=child_frame)
        message.twist.covariance = spatial_covariance(np.eye(3) * UNKNOWN_VARIANCE)
    message.pose.pose = MESSAGES.pose_in_plane(estimate.x, estimate.y, estimate.heading)
    message.pose.covariance = spatial_covariance(estimate.covariance)
    return message


def map_to_odom(estimate: LocationEstimate, odometry: Odometry) -> tuple[float, float, float]:
    """Return the pose of the frame of the odometry in that of the map: x, y and yaw."""
    pose = odometry.pose
    turn = math.remainder(estimate.heading - pose.yaw, math.tau)
    origin = complex(estimate.x, estimate.y) - cmath.rect(1.0, turn) * complex(pose.x, pose.y)
    return origin.real, origin.imag, turn


def road_markers(lines: Sequence[NDArray[np.float64]], header: Header) -> MarkerArray:
    """Return the roads, polylines (N, 2) in metres, as one marker of line segments."""
    points: list[Point] = []
    for line in lines:
        corners = [Point(x=x, y=y) for x, y in line.tolist()]
        points += [each for pair in pairwise(corners) for each in pair]
    return MarkerArray(markers=[Marker(
        header=header, ns='roads', type=Marker.LINE_LIST,
        pose=MESSAGES.pose_in_plane(0.0, 0.0, 0.0), scale=Vector3(x=_ROAD_WIDTH), color=_GREY,
        points=points)])


def candidate_markers(candidates: Sequence[Candidate], header: Header) -> MarkerArray:
    """Return the candidates as arrows, sized by their probabilities."""
    markers: list[Any] = [Marker(header=header, ns='candidates', action=Marker.DELETEALL)]
    for number, each in enumerate(candidates):
        size = max(_CERTAIN_SIZE * math.sqrt(each.probability), _SMALLEST_SIZE)
        markers.append(Marker(
            header=header, ns='candidates', id=number, type=Marker.ARROW,
            pose=MESSAGES.pose_in_plane(each.x, each.y, each.heading),
            scale=Vector3(x=size, y=size / 3, z=size / 3), color=_RED))
    return MarkerArray(markers=markers)
