# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Converts the values of the estimator to ROS messages, independent of the message classes.

The message classes of rclpy and of rosbags have the same keyword arguments, so the node and a bag
written offline use the same code.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core import Corner, Shift, TrajectoryEstimator, Travel, Update
from phase_traj_ros.core.codes.text import describe, describe_links
from phase_traj_ros.core.path.odometry import Odometry
from phase_traj_ros.io.messages.diagnostics import Level, Report
from phase_traj_ros.io.messages.topics import CHAIN_CODE, LINKS, Topic
from phase_traj_ros.parameters import MAX_PATH_POSES, NODE_NAME, Parameters

_NANOSECONDS = 10**9
TEXT_RUNS = 50
"""Runs of each code in the texts of the codes: the newest."""

UNKNOWN_VARIANCE = 1e6
"""Variance of unmeasured values."""

# Variance of the lateral speed, which is close to zero.
_SIDEWAYS = 0.01
# Encodings of grey images, by the type of their samples.
_GREY = {'uint8': 'mono8', 'uint16': 'mono16', 'float32': '32FC1'}
# Indices of the planar motion in x, y, z, roll, pitch and yaw: x, y and yaw.
_ON_THE_GROUND = np.ix_((0, 1, 5), (0, 1, 5))


class Messages:
    """Makes messages of the given classes; all methods are pure functions."""

    def __init__(self, types: Mapping[str, Callable[..., Any]]) -> None:
        """
        Use the classes ``types``, by names such as ``std_msgs/msg/Header``.

        Parameters
        ----------
        types
            Constructors of the required messages of builtin_interfaces, std_msgs, geometry_msgs,
            nav_msgs, sensor_msgs and diagnostic_msgs. The level of a DiagnosticStatus is passed
            as a number, the data of an Image as an array of bytes.

        """
        self._types = types

    def _make(self, kind: str, /, **values: Any) -> Any:
        return self._types[kind](**values)

    def time(self, stamp_ns: int) -> Any:
        """Return a stamp in nanoseconds as a builtin_interfaces/Time."""
        seconds, nanoseconds = divmod(stamp_ns, _NANOSECONDS)
        return self._make('builtin_interfaces/msg/Time', sec=seconds, nanosec=nanoseconds)

    def header(self, stamp_ns: int, frame_id: str) -> Any:
        """Return a std_msgs/Header."""
        return self._make('std_msgs/msg/Header', stamp=self.time(stamp_ns), frame_id=frame_id)

    def of_pair(
        self, update: Update, parameters: Parameters, *, camera_frame: str,
        wanted: Callable[[str], bool] = lambda _: True,
    ) -> Iterator[tuple[str, Any]]:
        """
        Yield the topic names and messages of a pair, see ``pair_topics``.

        ``camera_frame`` is the frame of the image, to which the shift belongs.
        A message is made only if ``wanted`` returns True for its topic: making it takes longer
        than sending it.
        """
        make, step = self._make, update.step
        dx, dy, response = _shift_values(update.shift)
        header = self.header(update.stamp_ns, parameters.path_frame)
        made: dict[str, Callable[[], Any]] = {
            'movement': lambda: make('std_msgs/msg/UInt8', data=int(step.movement)),
            'shift': lambda: make(
                'geometry_msgs/msg/Vector3Stamped', vector=self._vector(dx, dy),
                header=self.header(update.stamp_ns, camera_frame)),
            'response': lambda: make('std_msgs/msg/Float32', data=response),
            'status': lambda: make('std_msgs/msg/String', data=update.status.value),
            'pose': lambda: self.pose(update.tip, header),
            'pair': lambda: self.pair(update)}
        if step.appended:
            made['direction'] = lambda: make('std_msgs/msg/UInt8', data=int(step.direction))
        if (heading := update.heading) is not None:
            made['heading'] = lambda: make('std_msgs/msg/Float64', data=heading.heading)
            made['heading_stamped'] = lambda: make(
                'geometry_msgs/msg/QuaternionStamped', header=header,
                quaternion=self._yaw(heading.heading))
        if (odometry := update.odometry) is not None:
            in_metres = self.header(update.stamp_ns, parameters.odom_frame)
            made['odom'] = lambda: self.odometry(odometry, parameters.child_frame_id, in_metres)
            made['pose_with_covariance'] = lambda: make(
                'geometry_msgs/msg/PoseWithCovarianceStamped', header=in_metres,
                pose=self._pose_with_covariance(odometry))
            # A filter takes each twist for a new measurement.
            if heading is not None and heading.foreseen == 0.0:
                # A twist is given in the frame of the vehicle.
                made['speed'] = lambda: make(
                    'geometry_msgs/msg/TwistWithCovarianceStamped', twist=self._twist(odometry),
                    header=self.header(update.stamp_ns, parameters.child_frame_id))
        if update.camera is not None:
            made['camera'] = lambda: make('std_msgs/msg/String', data=str(update.camera))
        for topic, message in made.items():
            if wanted(topic):
                yield topic, message()
        for turn in update.turns if update.turns and wanted('turn') else ():
            yield 'turn', make(
                'geometry_msgs/msg/Vector3Stamped',
                header=self.header(turn.end_ns, parameters.path_frame),
                vector=self._vector(z=math.radians(turn.angle_deg)))

    def pair(self, update: Update) -> Any:
        """
        Return the values of a pair, together with their stamp, as a DiagnosticArray.

        DiagnosticArray is the standard message with a stamp, names and texts. It keeps the values
        of a pair together, and can be synchronised with images. The direction is empty if none
        was appended, the distance if it is unknown.
        """
        step, (dx, dy, response) = update.step, _shift_values(update.shift)
        report = Report(Level.OK, update.status.value, {
            'movement': str(int(step.movement)),
            'direction': str(int(step.direction)) if step.appended else '',
            'dx': str(dx), 'dy': str(dy), 'response': str(response),
            **_distance_values(update.travel),
        })
        return self.diagnostics(
            {'pair': report}, node=NODE_NAME, hardware_id='', stamp=self.time(update.stamp_ns))

    def of_all(self, topic: Topic, estimator: TrajectoryEstimator, parameters: Parameters) -> Any:
        """Return the message of a topic of ``whole_topics``, which covers all pairs so far."""
        if topic == CHAIN_CODE:
            return self._make('std_msgs/msg/String', data=str(describe(
                estimator.codes, frames=estimator.frames, max_runs=TEXT_RUNS)))
        if topic == LINKS:
            assert estimator.links is not None
            return self._make('std_msgs/msg/String', data=str(describe_links(
                estimator.links, unit=parameters.settings.length_unit.value,
                max_runs=TEXT_RUNS)))
        return self.path(
            estimator.path.points(MAX_PATH_POSES),
            self.header(estimator.last_stamp_ns or 0, parameters.path_frame))

    def diagnostics(
        self, reports: Mapping[str, Report], *, node: str, hardware_id: str, stamp: Any,
    ) -> Any:
        """
        Return a diagnostic_msgs/DiagnosticArray.

        Parameters
        ----------
        reports
            Reports by the names of their statuses.
        node
            Full name of the node.
        hardware_id
            Source of the images.
        stamp
            A builtin_interfaces/Time.

        """
        make = self._make
        return make(
            'diagnostic_msgs/msg/DiagnosticArray',
            header=make('std_msgs/msg/Header', stamp=stamp, frame_id=''),
            status=[
                make('diagnostic_msgs/msg/DiagnosticStatus', level=int(report.level),
                     name=f'{node}: {name}', message=report.message, hardware_id=hardware_id,
                     values=[make('diagnostic_msgs/msg/KeyValue', key=key, value=value)
                             for key, value in report.values.items()])
                for name, report in reports.items()])

    def image(self, image: NDArray[Any], header: Any) -> Any:
        """
        Return a sensor_msgs/Image.

        ``image`` is grey, (H, W) uint8, uint16 or float32, or BGR, (H, W, 3) uint8.
        """
        height, width, *colours = image.shape
        data = np.ascontiguousarray(image, image.dtype.newbyteorder('<')).reshape(-1)
        return self._make(
            'sensor_msgs/msg/Image', header=header, height=height, width=width,
            encoding='bgr8' if colours else _GREY[image.dtype.name], is_bigendian=0,
            step=image.nbytes // height, data=data.view(np.uint8))

    def pose(self, corner: Corner, header: Any) -> Any:
        """Return a pose of the path as a PoseStamped."""
        return self._make(
            'geometry_msgs/msg/PoseStamped', header=header,
            pose=self.pose_in_plane(corner.x, corner.y, corner.yaw))

    def odometry(self, odometry: Odometry, child_frame_id: str, header: Any) -> Any:
        """Return a nav_msgs/Odometry; the variances of unmeasured values are large."""
        return self._make(
            'nav_msgs/msg/Odometry', header=header, child_frame_id=child_frame_id,
            pose=self._pose_with_covariance(odometry), twist=self._twist(odometry))

    def _pose_with_covariance(self, odometry: Odometry) -> Any:
        return self._make(
            'geometry_msgs/msg/PoseWithCovariance', pose=self.pose_in_plane(
                odometry.pose.x, odometry.pose.y, odometry.pose.yaw),
            covariance=spatial_covariance(odometry.covariance))

    def _twist(self, odometry: Odometry) -> Any:
        return self._make(
            'geometry_msgs/msg/TwistWithCovariance', twist=self._make(
                'geometry_msgs/msg/Twist', linear=self._vector(odometry.speed),
                angular=self._vector(z=odometry.yaw_rate)),
            covariance=spatial_covariance(np.diag(
                [odometry.speed_variance, _SIDEWAYS, odometry.yaw_rate_variance])))

    def pose_in_plane(self, x: float, y: float, yaw: float) -> Any:
        """Return a geometry_msgs/Pose at height 0, from metres and radians."""
        return self._make(
            'geometry_msgs/msg/Pose', orientation=self._yaw(yaw), position=self._make(
                'geometry_msgs/msg/Point', x=float(x), y=float(y), z=0.0))

    def _vector(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
        return self._make('geometry_msgs/msg/Vector3', x=x, y=y, z=z)

    def _yaw(self, angle: float) -> Any:
        """Return a rotation about the vertical axis, in radians, as a Quaternion."""
        return self._make(
            'geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=math.sin(angle / 2),
            w=math.cos(angle / 2))

    def path(self, points: Sequence[Corner], header: Any) -> Any:
        """Return a nav_msgs/Path."""
        return self._make('nav_msgs/msg/Path', header=header, poses=[
            self.pose(point, self.header(point.stamp_ns, header.frame_id)) for point in points])


def _distance_values(travel: Travel | None) -> dict[str, str]:
    known = travel if travel is not None and travel.known else None
    return {
        'distance': '' if known is None else str(known.distance),
        'distance_variance': '' if known is None else str(known.variance),
        'distance_state': '' if travel is None else travel.state.value,
    }


def _shift_values(shift: Shift | None) -> tuple[float, float, float]:
    """Return the raw shift in pixels, NaN if the two frames cannot be compared; the response."""
    return (math.nan, math.nan, 0.0) if shift is None else (shift.dx, shift.dy, shift.response)


def spatial_covariance(part: ArrayLike) -> NDArray[np.float64]:
    """
    Return the covariance of a pose or twist message, (36,), from that of x, y and yaw, (3, 3).

    The variances of z, roll and pitch are ``UNKNOWN_VARIANCE``.
    """
    whole = np.diag([0.0, 0.0, UNKNOWN_VARIANCE, UNKNOWN_VARIANCE, UNKNOWN_VARIANCE, 0.0])
    whole[_ON_THE_GROUND] = part
    return whole.ravel()
