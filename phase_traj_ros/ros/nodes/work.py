# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The work of the node: images in, codes and path out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
import time
from typing import TYPE_CHECKING

import cv2
import numpy as np
from phase_traj_ros.core import (
    CodeSource,
    FrameStream,
    Measured,
    Outcome,
    Restarted,
    Skipped,
    Started,
    Update,
)
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.correlation.phase_correlation import MIN_SIDE
from phase_traj_ros.core.correlation.transforms import find_transform, transform_hint
from phase_traj_ros.errors import FrameError, ParameterError, PhaseTrajError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.estimator import make_estimator
from phase_traj_ros.io.results.files import Snapshot
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.diagnostics import Diagnostics
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.health import Health, Stage
from phase_traj_ros.ros.inputs.camera import CameraInput
from phase_traj_ros.ros.inputs.image import image_topic, ImageInput
from phase_traj_ros.ros.inputs.mounting import MountInput
from phase_traj_ros.ros.inputs.speed import SpeedInput
from phase_traj_ros.ros.nodes.warnings import Warnings
from phase_traj_ros.ros.outputs.topics import Outputs
from phase_traj_ros.ros.saving import Saving
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

if TYPE_CHECKING:
    from phase_traj_ros.io.maps.road_file import RoadFile
    from phase_traj_ros.ros.location.location import Location


class Work:
    """
    A thin adapter between ROS and ``FrameStream``.

    It offers topics and services as soon as it is made, and receives images between ``start`` and
    ``stop``.
    """

    def __init__(
        self, node: Node, mounting: Mounting, *,
        on_other_mount: Callable[[], None] = lambda: None, roads: RoadFile | None = None,
    ) -> None:
        """
        Make publishers and services on ``node``.

        Parameters
        ----------
        node
            The node.
        mounting
            Values of the parameters, and the mount of the camera.
        on_other_mount
            Called when /tf_static has a mount for which the work has to start anew.
        roads
            The roads of the map if they have been read before.

        Raises
        ------
        ParameterError
            The name of a topic is invalid, or the mask or the map cannot be used.
        MapError
            The map cannot be read.
        OutputError
            ``output_dir`` cannot be written.
        MissingDependencyError
            A package that a parameter requires is not installed.

        """
        self._node = node
        self.mounting = mounting
        """Values of the parameters, and the mount of the camera."""
        self._on_other_mount = on_other_mount
        values = mounting.parameters
        # More threads take more processor time and save none: see the measurements of options.
        cv2.setNumThreads(1)
        self._estimator = make_estimator(values)
        self._stream: FrameStream[StampedFrame] = FrameStream(self._estimator)
        self._health = Health()
        self._camera: CameraInput | None = None
        self._speed: SpeedInput | None = None
        self._frame_shape: tuple[int, ...] | None = None
        self._active = False
        self._warnings = Warnings(node, self._estimator)
        self._offered = Entities(node)
        self._listening = Entities(node)
        self._location: Location | None = None
        self._mount_input: MountInput | None = None
        with self._offered as offered:
            self._outputs = Outputs(offered, self._estimator, values)
            self._saving = Saving(node, offered, values.output_dir, self._snapshot)
            # Images are taken while an answer waits for the drive to be written.
            offered.create_service(
                Trigger, '~/reset', self._on_reset, callback_group=ReentrantCallbackGroup())
            if values.map_file:
                # To load the search takes a tenth of the start of a node.
                from phase_traj_ros.ros.location import location
                self._location = location.Location(node, offered, values, roads)
        # A subscriber receives the empty chain code before the first image.
        self._outputs.publish_state()

    @property
    def roads(self) -> RoadFile | None:
        """Return the roads of the map; None without one."""
        return None if self._location is None else self._location.roads

    def start(self) -> None:
        """
        Subscribe to the images, and to the calibration and the speed if they are used.

        A new drive starts: the movement in the meantime is unknown.
        """
        if self._estimator.frames:
            self.restart()
        self._camera = self._speed = None
        node, values = self._node, self.mounting.parameters
        # The executor delivers simultaneous messages in the order of subscription.
        settings = self._estimator.settings
        with self._listening as listening:
            if settings.awaits_lens or settings.learns_lens:
                self._camera = CameraInput(
                    node, listening, rectified=values.rectified, on_camera=self._on_camera)
            if values.use_speed_topic:
                self._speed = SpeedInput(node, listening, self._estimator.add_speed)
            self._mount_input = MountInput(listening, values.child_frame_id, self._on_mount)
            images = ImageInput(
                node, listening, values, self._health, on_frame=self._on_frame,
                on_undecodable=self._stream.skip)
            location = self._location
            Diagnostics(
                node, listening, self._health, images, self._estimator,
                None if location is None else location.report)
            fix = [] if location is None else [location.listen(listening)]
        self._active = True
        topics = [each.topic for each in (images, self._camera, self._speed) if each is not None]
        node.get_logger().info(
            f'listening to {", ".join([*topics, *fix])}, codes from the {self._coded_from()},'
            f' transforms by {find_transform().name}')
        hint = transform_hint()
        if hint:
            node.get_logger().info(hint)

    def stop(self) -> None:
        """Destroy the subscriptions, and use a frame that was held."""
        self._active = False
        self._listening.destroy()
        self._publish_all(self._stream.finish())

    def restart(self) -> Future | None:
        """Save the drive, reset the estimator and publish its state; see ``Saving.end_drive``."""
        saved = self._end_drive()
        self._stream.reset()
        self._outputs.publish_state()
        return saved

    def close(self) -> bool:
        """Save the drive, destroy all that is made on the node; return ``Saving.worked``."""
        with ExitStack() as rest:
            rest.callback(self._offered.destroy)
            if self._location is not None:
                rest.callback(self._location.close)
            rest.callback(self._saving.close)
            self.stop()
        return self._saving.worked

    def check(self, values: Parameters) -> None:
        """
        Check that the estimator can continue with other values and loses nothing.

        Raises
        ------
        ValueError
            A value cannot change while the estimator runs, would restart the codes, or leaves
            nothing of the frames.

        """
        settings = self.mounting.with_given(values).parameters.settings
        if self._location is not None:
            self._location.check(values)
        used, shape = self._estimator.settings, self._frame_shape
        self._estimator.check(settings)
        if self._active and settings.code_source is not used.code_source:
            raise ParameterError(
                'a threshold selects what the codes are made from: it would restart them, with'
                f' code_source {settings.code_source.value} instead of {used.code_source.value};'
                ' set it at the start, or while the node is inactive')
        if shape is not None and settings.view != used.view:
            height, width = settings.view.of(np.broadcast_to(np.uint8(0), shape)).shape
            if min(height, width) < MIN_SIDE:
                raise ParameterError(
                    f'shift.decimation leaves {width}x{height} pixels of images of'
                    f' {shape[1]}x{shape[0]}: leave at least {MIN_SIDE}x{MIN_SIDE}')

    def change(self, values: Parameters) -> None:
        """Continue with other values of the parameters."""
        mounting = self.mounting.with_given(values)
        values = mounting.parameters
        coded_from = self._estimator.settings.code_source
        if self._estimator.frames and not self._active:
            # The drive is over: it is saved with the parameters that it had.
            self.restart()
        self.mounting, self._outputs.parameters = mounting, values
        self._warnings.threshold_changed()
        self._estimator.reconfigure(values.settings)
        if self._estimator.settings.code_source is not coded_from:
            self._outputs.publish_state()
            self._node.get_logger().info(f'restarted, with codes from the {self._coded_from()}')
        if self._mount_input is not None:
            # The frame of the vehicle may be another, or the mount allowed by the parameters now.
            self._mount_input.look()

    def follow_mount(self) -> Mounting | None:
        """Continue with the newest mount; return what has to start anew for it, if anything."""
        if self._mount_input is None or self._mount_input.newest is None:
            return None
        try:
            mounting = self.mounting.with_mount(self._mount_input.newest)
        except PhaseTrajError as error:
            self._warnings.of_mount(f'/tf_static is not used: {error}')
            return None
        self._warnings.of_mount(*mounting.doubts)
        if not mounting.acts_as(self.mounting):
            return mounting
        self.mounting = mounting
        return None

    def _on_mount(self) -> bool:
        starts_anew = self.follow_mount() is not None
        if starts_anew:
            self._on_other_mount()
        return starts_anew

    def _on_frame(self, frame: StampedFrame) -> None:
        """
        Push one frame into the stream, and publish what comes of it.

        Raises
        ------
        FrameError
            This frame, or one held before it, cannot be used.

        """
        self._frame_shape = frame.image.shape
        assert self._mount_input is not None
        if self._mount_input.seen_by(frame.frame_id):
            # The node starts anew, with the camera as it is mounted.
            return
        unusable = self._publish_all(self._stream.push(frame))
        self._warnings.of_stamps()
        if unusable is not None:
            awaited = self._camera if self._estimator.settings.awaits_lens else None
            raise FrameError((awaited and awaited.missing) or unusable)

    def _publish_all(self, outcomes: Iterable[Outcome[StampedFrame]]) -> str | None:
        """Publish outcomes as they come; return why the last unusable frame was skipped."""
        unusable, began = None, time.perf_counter_ns()
        for outcome in outcomes:
            match outcome:
                case Restarted(newest_ns, stamp_ns):
                    self._end_drive()
                    went = 'back' if stamp_ns < newest_ns else 'on'
                    self._node.get_logger().warning(
                        f'time went {went} by {abs(newest_ns - stamp_ns) / 1e9:.3f} s, from'
                        f' {newest_ns / 1e9:.3f} to {stamp_ns / 1e9:.3f}: restarted')
                case Started():
                    self._outputs.publish_state()
                case Measured(frame, update):
                    self._publish(frame, update, time.perf_counter_ns() - began)
                case Skipped(_, reason):
                    unusable = reason
            began = time.perf_counter_ns()
        return unusable

    def _publish(self, frame: StampedFrame, update: Update, estimated_ns: int) -> None:
        began = time.perf_counter_ns()
        update = self.mounting.at_base(update)
        if update.camera is not None:
            self._node.get_logger().info(f'camera: {update.camera}')
        self._warnings.of_threshold(update)
        if self._speed is not None:
            self._warnings.of_speed(update, self._speed.topic)
        self._outputs.publish(frame, update)
        if self._location is not None:
            self._location.add(update)
        if update.shift is not None:
            self._health.responses.append(update.shift.response)
        measure_ns = self._estimator.measure_ns
        self._health.took(Stage.MEASURE, measure_ns)
        self._health.took(Stage.CODE, estimated_ns - measure_ns)
        self._health.took(Stage.PUBLISH, time.perf_counter_ns() - began)

    def _end_drive(self) -> Future | None:
        saved = self._saving.end_drive()
        if self._location is not None and self._estimator.last_stamp_ns is not None:
            self._location.interrupt(self._estimator.last_stamp_ns)
        return saved

    def _snapshot(self) -> Snapshot:
        return Snapshot.of(
            self._estimator, self.mounting,
            source=image_topic(self._node, self.mounting.parameters))

    def _coded_from(self) -> str:
        settings = self._estimator.settings
        if settings.code_source is CodeSource.AUTO:
            return 'turns'
        if settings.by_heading:
            return f'heading, in {settings.connectivity} directions'
        return f'shift, threshold {settings.threshold:g} px/frame'

    def _on_camera(self, camera: CameraModel) -> None:
        self._estimator.use_lens(self.mounting.parameters.calibrated(camera))

    async def _on_reset(
        self, _: Trigger.Request, response: Trigger.Response,
    ) -> Trigger.Response:
        frames, saved = self._estimator.frames, self.restart()
        response.success, response.message = True, f'restarted after {frames} frames'
        self._node.get_logger().info(response.message)
        if saved is not None:
            response.success, where = await self._saving.answer(saved)
            doubt = '' if response.success else 'the drive is not saved: '
            response.message += f'; {doubt}{where}'
        return response
