# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates the vehicle from pairs of frames and position fixes, and publishes its place."""

import math

from nav_msgs.msg import Odometry as OdometryMessage
from phase_traj_ros.core import LocationEstimate, MapLocator, Update
from phase_traj_ros.core.localization.fixes import check_age
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_classes import Roads
from phase_traj_ros.io.maps.road_file import read_roads, RoadFile
from phase_traj_ros.io.messages.diagnostics import Level, Report
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.parameters import MAP_FRAME, Parameters
from phase_traj_ros.ros.entities import Entities, LATCHED, PER_PAIR
from phase_traj_ros.ros.location.messages import (
    candidate_markers,
    fix_message,
    map_to_odom,
    odometry_message,
    position_fix,
    road_markers,
)
from phase_traj_ros.ros.location.worker import LocatorWorker, Moved
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.ros.outputs.transform import MapTransform
from phase_traj_ros.tasks.location.motion import ANYWHERE, Motions, MovedPair
from phase_traj_ros.tasks.location.odometry import IN_HEIGHTS, IN_METRES
from phase_traj_ros.tasks.location.run import UNKNOWN
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import NavSatFix
from visualization_msgs.msg import MarkerArray

_FIXES = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
_CANDIDATES_S = 1.0
_THROTTLE_S = 10.0


class Location:
    """
    Locates the vehicle on the road map of the parameter ``map_file``.

    The locator runs in its own thread. Its estimates are published with the next frame or within
    a second, with the stamps of the frames that they belong to.
    """

    def __init__(
        self, node: Node, entities: Entities, values: Parameters, roads: RoadFile | None = None,
    ) -> None:
        """
        Start the locator, and make the publishers on ``node``.

        ``roads`` are those of the map; None reads them.

        Raises
        ------
        ParameterError
            The codes come from the shift, or ``map_datum`` is not a position.
        MapError
            The map cannot be used, see ``read_roads``.
        MissingDependencyError
            The map or a message needs a package that is not installed.

        """
        self.check(values)
        self._node = node
        self._values = values
        self._motions = Motions()
        self._estimate, self._estimate_ns = UNKNOWN, 0
        self._stamp_ns: int | None = None
        self._failed = self._unmeasured = False
        self.roads = roads or read_roads(
            user_path(values.map_file), Roads(values.map_roads),
            datum=_datum(values.map_datum))
        """The roads of the map."""
        self._fix = entities.create_publisher(NavSatFix, '~/fix', PER_PAIR)
        self._odom = entities.create_publisher(OdometryMessage, '~/odom_map', PER_PAIR)
        self._candidates = entities.create_publisher(MarkerArray, '~/candidates', 1)
        markers = entities.create_publisher(MarkerArray, '~/roads', LATCHED)
        markers.publish(road_markers(self.roads.lines, MESSAGES.header(0, MAP_FRAME)))
        # REP 105 needs an odometry in metres; /tf_static may give the camera height later.
        self._transform = (
            MapTransform(node, entities, values.odom_frame)
            if values.publish_map_tf and values.settings.metric else None)
        # Last: nobody would stop its thread if any of the above failed.
        self._worker = LocatorWorker(MapLocator(
            self.roads.road_map, scale=IN_METRES if values.settings.metric else IN_HEIGHTS))
        origin = self.roads.projection
        node.get_logger().info(
            f'{values.map_file}: {self.roads.length / 1e3:.0f} km of road, datum'
            f' {origin.latitude:.6f},{origin.longitude:.6f}')

    @staticmethod
    def check(values: Parameters) -> None:
        """
        Check that the vehicle can be located with these parameters.

        Raises
        ------
        ParameterError
            The codes come from the shift.

        """
        # The height that measures the distance may still come, from /tf_static.
        if not values.settings.by_heading:
            raise ParameterError(
                f"parameter 'map_file' is {values.map_file!r}: it needs the measured heading and"
                ' distance, so leave code_source auto, without a threshold')

    def listen(self, entities: Entities) -> str:
        """Subscribe to the topic ``fix``, and publish candidates; return its full name."""
        entities.create_timer(_CANDIDATES_S, self._publish_candidates)
        entities.create_subscription(NavSatFix, 'fix', self._on_fix, _FIXES)
        return str(self._node.resolve_topic_name('fix'))

    def add(self, update: Update) -> None:
        """Queue a pair of frames to be located; publish the estimates since the last one."""
        pair = MovedPair.of(update)
        # A repeated picture does not tell.
        self._unmeasured = pair is None or (self._unmeasured and pair.distance is None)
        if pair is not None:
            self._stamp_ns = update.stamp_ns
            self._worker.add(Moved(update.stamp_ns, self._motions.of(pair), update.odometry))
        self._publish_placed()

    def interrupt(self, stamp_ns: int) -> None:
        """Report the end of a drive at ``stamp_ns``, after which the motion is unknown."""
        self._motions = Motions()
        # The next drive may begin much later, or use another clock.
        self._stamp_ns = None
        self._worker.add(Moved(stamp_ns, (ANYWHERE,)))

    def close(self) -> None:
        """Stop the thread of the locator."""
        self._worker.close()

    def report(self) -> Report:
        """Return the status for /diagnostics."""
        estimate, worker = self._estimate, self._worker
        values = {
            'map': self._values.map_file,
            'probability': f'{estimate.probability:.3f}',
            'waiting': str(worker.waiting), 'left out': str(worker.left_out),
            'fixes used': str(worker.fixes_used), 'fixes refused': str(worker.fixes_refused)}
        if worker.failure is not None:
            return Report(Level.ERROR, f'the locator has failed: {worker.failure}', values)
        if self._transform is not None and self._transform.other:
            return Report(Level.ERROR, 'another node publishes the parent of the odometry', values)
        if self._unmeasured:
            return Report(
                Level.WARN, 'the place needs the measured distance: leave code_source and'
                ' path_from auto, or give the camera height', values)
        if not estimate.claimed:
            return Report(Level.OK, 'the place is not known', values)
        latitude, longitude = self.roads.projection.to_degrees(estimate.x, estimate.y)
        return Report(Level.OK, 'the place is known', {
            **values, 'latitude': f'{latitude:.7f}', 'longitude': f'{longitude:.7f}',
            'standard deviation (m)': f'{estimate.standard_deviation:.1f}'})

    def _on_fix(self, message: NavSatFix) -> None:
        try:
            fix = position_fix(message, self.roads.projection)
            if fix is None:
                return
            if fix.stamp_ns is not None and self._stamp_ns is not None:
                check_age(self._stamp_ns - fix.stamp_ns)
            self._worker.fix(fix)
        except ValueError as error:
            self._node.get_logger().error(
                f'skipped a fix: {error}', throttle_duration_sec=_THROTTLE_S)

    def _publish_placed(self) -> None:
        if self._worker.failure is not None and not self._failed:
            self._failed = True
            self._node.get_logger().error(
                f'the place is no longer computed: {self._worker.failure!r}')
        for moved, estimate in self._worker.take():
            known = self._estimate.claimed
            self._estimate, self._estimate_ns = estimate, moved.stamp_ns
            if estimate.claimed != known:
                self._node.get_logger().info(f'the place is {"no longer " if known else ""}known')
            self._publish(moved, estimate)

    def _publish(self, moved: Moved, estimate: LocationEstimate) -> None:
        values = self._values
        self._fix.publish(fix_message(
            estimate, moved.stamp_ns, values.child_frame_id, self.roads.projection))
        if not estimate.claimed:
            return
        header = MESSAGES.header(moved.stamp_ns, MAP_FRAME)
        self._odom.publish(
            odometry_message(estimate, moved.odometry, header, values.child_frame_id))
        if self._transform is not None and moved.odometry is not None:
            self._transform.publish(
                header, MESSAGES.pose_in_plane(*map_to_odom(estimate, moved.odometry)))

    def _publish_candidates(self) -> None:
        self._publish_placed()
        if self._candidates.get_subscription_count():
            self._candidates.publish(candidate_markers(
                self._estimate.candidates, MESSAGES.header(self._estimate_ns, MAP_FRAME)))


def _datum(text: str) -> LocalProjection | None:
    """Return the projection around ``LAT,LON``; None, for the middle of the map, if empty."""
    if not text:
        return None
    try:
        latitude, longitude = map(float, text.split(','))
    except ValueError:
        latitude = longitude = math.nan
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        raise ParameterError(
            f"parameter 'map_datum' is {text!r}: give LAT,LON in degrees, such as 49.01,8.40, or"
            ' leave it empty for the middle of the map')
    return LocalProjection(latitude, longitude)
