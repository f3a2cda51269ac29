# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The live node: images in, codes and path out."""

from collections.abc import Sequence

from phase_traj_ros.core import TrajectoryEstimator
from phase_traj_ros.errors import FrameError, ParameterError
from phase_traj_ros.io.image_msgs import to_grey
from phase_traj_ros.io.stamps import StampRule, to_nanoseconds
from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.declare import changed, declare_parameters, unknown_overrides
from phase_traj_ros.ros.outputs import Outputs
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger

_THROTTLE_S = 5.0


class PhaseTrajNode(Node):
    """A thin adapter between ROS and ``TrajectoryEstimator``."""

    def __init__(self) -> None:
        """
        Declare the parameters and start listening.

        Raises
        ------
        ParameterError
            A parameter given at the start is not allowed.

        """
        super().__init__(NODE_NAME)
        self._parameters_now = declare_parameters(self)
        self._estimator = TrajectoryEstimator(self._parameters_now.estimator_settings())
        self._stamps = StampRule()
        self._outputs = Outputs(self, self._estimator, self._parameters_now)
        self._image = self.create_subscription(
            Image, 'image', self._on_image, qos_profile_sensor_data,
            qos_overriding_options=QoSOverridingOptions.with_default_policies())
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        for name in unknown_overrides(self):
            self.get_logger().warning(
                f'there is no parameter {name!r}: it was given at the start and has no effect')
        self.get_logger().info(
            f'listening to {self._image.topic_name}, threshold'
            f' {self._parameters_now.threshold:g} px/frame')

    def _on_image(self, message: Image) -> None:
        stamp_ns = self._stamps.stamp_ns(
            to_nanoseconds(message.header.stamp), self.get_clock().now().nanoseconds)
        previous_ns = self._estimator.last_stamp_ns
        resets = self._estimator.counters.time_resets
        try:
            update = self._estimator.update(to_grey(message), stamp_ns)
        except FrameError as error:
            self.get_logger().error(
                f'skipped an image on {self._image.topic_name}: {error}',
                throttle_duration_sec=_THROTTLE_S)
            return
        if self._estimator.counters.time_resets > resets:
            assert previous_ns is not None
            self.get_logger().warning(
                f'time went back by {(previous_ns - stamp_ns) / 1e9:.3f} s, from'
                f' {previous_ns / 1e9:.3f} to {stamp_ns / 1e9:.3f}: started anew')
            self._outputs.publish_state()
        if update is not None:
            self._outputs.publish(update)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        frames = self._estimator.frames
        self._estimator.reset()
        self._outputs.publish_state()
        response.success = True
        response.message = f'started anew after {frames} frames'
        self.get_logger().info(response.message)
        return response

    def _check_parameters(self, updates: Sequence[Parameter]) -> SetParametersResult:
        try:
            changed(self._parameters_now, updates)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, updates: Sequence[Parameter]) -> None:
        self._parameters_now = changed(self._parameters_now, updates)
        self._outputs.parameters = self._parameters_now
        self._estimator.set_threshold(self._parameters_now.threshold)
