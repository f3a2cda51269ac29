# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the road in the frames of a camera, whose lens is given or learned from the drive."""

from dataclasses import replace
import math

from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.road.tuning import TUNING
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.core.settings import EstimatorSettings


class RoadCamera:
    """Measures the distance of each pair in camera heights, if the settings require it."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a camera before its first frame."""
        self._settings = settings
        self._meter: RoadMeter | None = None
        self._form: tuple[Lens, tuple[int, ...], bool] | None = None
        self._newest: Frame | None = None

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Continue with other settings."""
        self._settings = settings

    def forget(self) -> None:
        """Restart with the next frame; the pitch of the camera is kept."""
        self._newest = None
        if self._meter is not None:
            self._meter.forget()

    def start(self, frame: Frame, camera: YawCamera | None) -> None:
        """Add a frame, (H, W), that is the first of a pair; it must not change afterwards."""
        if camera is not None and self._enabled:
            self._follow(camera, frame).start(frame)
            self._newest = frame

    def measure(
        self, frame: Frame, camera: YawCamera | None, yaw: YawMeasurement | None, interval: float,
        *, still: bool, interval_deviation: float,
    ) -> Travel | None:
        """
        Add the next frame and return the distance of its pair; None if it is not required.

        See ``RoadMeter.update``; ``yaw`` is None if the frames cannot be compared.
        """
        if camera is None or not self._enabled:
            return None
        travel = self._follow(camera, frame).update(
            frame, interval, None if yaw is None else yaw.motion,
            yaw=None if yaw is None else yaw.yaw, still=still,
            interval_deviation=interval_deviation)
        self._newest = frame
        return travel.scaled(1.0, camera.lens.focal_deviation)

    def reaches(self, camera: YawCamera, distance: float) -> bool:
        """Return whether the road can still be compared after this distance in camera heights."""
        if self._newest is None or not self._enabled:
            return True
        return (not self._follow(camera, self._newest).needs_every_frame
                and distance <= TUNING.max_foreseen_slide)

    @property
    def _enabled(self) -> bool:
        """Return whether the distance is measured on the road; a constant speed replaces it."""
        return self._settings.measures_distance and self._settings.speed == 0.0

    def _follow(self, camera: YawCamera, frame: Frame) -> RoadMeter:
        """Return the meter for the current lens and mask."""
        lens, upside_down = camera.lens, self._settings.view.rotate_180
        form = (lens, frame.shape, upside_down)
        if form == self._form and self._meter is not None:
            self._meter.use_mask(camera.pixel_weights)
            return self._meter
        speeds = None if self._meter is None else self._meter.speed_filter
        if speeds is not None:
            speeds.deviation += TUNING.lens_change_error * abs(speeds.speed)
        horizon, given = lens.horizon, math.radians(self._settings.camera_pitch_deg)
        self._form, self._meter = form, RoadMeter(
            camera.model, replace(horizon, pitch=given) if given else horizon,
            pitch_known=lens.pitch_known or given != 0.0, rotate_180=upside_down,
            mask=camera.pixel_weights, speed_filter=speeds, keyframes=self._settings.keyframes)
        if self._newest is not None and self._newest.shape == frame.shape:
            self._meter.start(self._newest)
        return self._meter
