# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The live node: images in, codes and path out."""

from collections.abc import Sequence
import time

import cv2
from phase_traj_ros.core import Lens, Update
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.io.replay.estimator import make_estimator
from phase_traj_ros.io.sources.base import Frame
from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.declare import changed, declare_parameters, unknown_overrides
from phase_traj_ros.ros.diagnostics import Diagnostics
from phase_traj_ros.ros.health import Health, Stage
from phase_traj_ros.ros.inputs.camera import CameraInput
from phase_traj_ros.ros.inputs.image import ImageInput
from phase_traj_ros.ros.inputs.speed import SpeedInput
from phase_traj_ros.ros.outputs.topics import Outputs
from phase_traj_ros.ros.saving import Saving
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
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
        OutputError
            Shifts are to be recorded and cannot be.
        MissingDependencyError
            What a parameter asks for is not installed.

        """
        super().__init__(NODE_NAME)
        self._values = declare_parameters(self)
        self._use_threads()
        self._estimator = make_estimator(self._values)
        self._health = Health()
        self._outputs = Outputs(self, self._estimator, self._values)
        # Of what comes at the same time, the executor hands over in the order of subscription.
        self._camera: CameraInput | None = None
        if self._values.needs_camera:
            self._camera = CameraInput(
                self, rectified=self._values.rectified, on_camera=self._on_camera)
        self._speed: SpeedInput | None = None
        if self._values.use_speed_topic:
            self._speed = SpeedInput(self, self._estimator.add_speed)
        self._input = ImageInput(self, self._values, self._health, self._on_frame)
        self._diagnostics = Diagnostics(self, self._health, self._input, self._estimator)
        self._saving = Saving(self, self._values, self._estimator, lambda: self._input.topic)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        for name in unknown_overrides(self):
            self.get_logger().warning(
                f'there is no parameter {name!r}: it was given at the start and has no effect')
        topics = [
            each.topic for each in (self._input, self._camera, self._speed) if each is not None]
        self.get_logger().info(
            f'listening to {", ".join(topics)}, codes from the {self._coded_from()}')

    def destroy_node(self) -> None:
        """Take the node down."""
        self._saving.close()
        super().destroy_node()

    def _on_frame(self, frame: Frame) -> None:
        """Put one frame through the estimator; publish what it adds."""
        if self._camera is not None:
            self._camera.require()
        began = time.perf_counter_ns()
        previous_ns = self._estimator.last_stamp_ns
        resets = self._estimator.counters.time_resets
        update = self._estimator.update(frame.image, frame.stamp_ns, encoding=frame.encoding)
        estimated = time.perf_counter_ns()
        if self._estimator.counters.time_resets > resets and previous_ns is not None:
            self.get_logger().warning(
                f'time went back by {(previous_ns - frame.stamp_ns) / 1e9:.3f} s, from'
                f' {previous_ns / 1e9:.3f} to {frame.stamp_ns / 1e9:.3f}: started anew')
            self._outputs.publish_state()
        if update is None:
            return
        self._warn_without_speed(update)
        self._outputs.publish(frame, update)
        self._saving.record(update)
        if update.shift is not None:
            self._health.responses.append(update.shift.response)
        correlate_ns = self._estimator.correlate_ns
        self._health.took(Stage.CORRELATE, correlate_ns)
        self._health.took(Stage.CODE, estimated - began - correlate_ns)
        self._health.took(Stage.PUBLISH, time.perf_counter_ns() - estimated)

    def _coded_from(self) -> str:
        values = self._values
        if values.codes_from_heading:
            return f'heading, in {values.connectivity} directions'
        if values.threshold_deg_s > 0:
            return f'shift, threshold {values.threshold_deg_s:g} deg/s'
        return f'shift, threshold {values.threshold:g} px/frame'

    def _on_camera(self, camera: CameraModel) -> None:
        self._estimator.use_lens(Lens(camera=camera))

    def _warn_without_speed(self, update: Update) -> None:
        if self._speed is None or update.odometry is not None:
            return
        newest_ns = self._estimator.newest_speed_ns
        known = 'none has come yet'
        if newest_ns is not None:
            known = f'the newest is {(update.stamp_ns - newest_ns) / 1e9:+.3f} s older'
        self.get_logger().warning(
            f'no speed on {self._speed.topic} for the time of an image ({known}): odom does not go'
            ' on', throttle_duration_sec=_THROTTLE_S)

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
            self._estimator.check(changed(self._values, updates).estimator_settings())
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, updates: Sequence[Parameter]) -> None:
        self._values = changed(self._values, updates)
        self._outputs.parameters = self._values
        self._estimator.reconfigure(self._values.estimator_settings())
        self._use_threads()

    def _use_threads(self) -> None:
        # OpenCV takes a negative number as leave to choose.
        cv2.setNumThreads(self._values.threads or -1)
