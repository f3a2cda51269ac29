# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the road in the frames of a camera, whose lens is given or learned from the drive."""

from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.road.tuning import TUNING
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement


class RoadCamera:
    """Measures the distance of each pair in camera heights, with the current lens and mask."""

    def __init__(self, *, pitch_deg: float = 0.0) -> None:
        """
        Make a camera before its first frame.

        ``pitch_deg`` is its pitch relative to the road, positive down, 0 if unknown.
        """
        self._pitch_deg = pitch_deg
        self._meter: RoadMeter | None = None
        self._form: tuple[Lens, tuple[int, ...], bool] | None = None
        self._newest: Frame | None = None

    def forget(self) -> None:
        """Restart with the next frame; the pitch of the camera is kept."""
        self._newest = None
        if self._meter is not None:
            self._meter.forget()

    def start(self, frame: Frame, camera: YawCamera) -> None:
        """Add a frame, (H, W), that is the first of a pair; it must not change afterwards."""
        self._follow(camera, frame).start(frame, camera.roll.on_road)
        self._newest = frame

    def measure(
        self, frame: Frame, camera: YawCamera, yaw: YawMeasurement | None, interval: float, *,
        still: bool = False, interval_deviation: float = 0.0,
    ) -> Travel:
        """
        Add the next frame and return the distance of its pair.

        See ``RoadMeter.update``; ``yaw`` is None if the frames cannot be compared.
        """
        travel = self._follow(camera, frame).update(
            frame, interval, None if yaw is None else yaw.motion,
            yaw=None if yaw is None else yaw.yaw, azimuth=camera.azimuth, roll=camera.roll.on_road,
            still=still, interval_deviation=interval_deviation)
        self._newest = frame
        return travel.scaled(1.0, camera.lens.focal_deviation)

    def reaches(self, camera: YawCamera, distance: float) -> bool:
        """Return whether the road can still be compared after this distance in camera heights."""
        return self._newest is None or (
            not self._follow(camera, self._newest).needs_every_frame
            and abs(distance) <= TUNING.max_foreseen_slide)

    def _follow(self, camera: YawCamera, frame: Frame) -> RoadMeter:
        """Return the meter for the current lens and mask."""
        lens, before = camera.lens, self._meter
        form = (lens, frame.shape, camera.rotate_180)
        if form == self._form and before is not None:
            before.use_mask(camera.pixel_weights)
            return before
        speeds = pitch = None
        if self._form is not None and before is not None:
            speeds = before.speed_filter
            speeds.speed *= lens.focal_ratio(self._form[0], frame.shape[1])
            speeds.deviation += TUNING.lens_change_error * abs(speeds.speed)
            # The column of the principal point alone does not change the pitch; turning the
            # camera upside down does.
            if (lens.horizon, camera.rotate_180) == (self._form[0].horizon, self._form[2]):
                pitch = before.pitch
        self._form, self._meter = form, RoadMeter(
            camera.model, lens.horizon.with_given(pitch_deg=self._pitch_deg),
            mask=camera.pixel_weights, speed_filter=speeds, pitch=pitch)
        if self._newest is not None and self._newest.shape == frame.shape:
            self._meter.start(self._newest, camera.roll.on_road)
        return self._meter
