# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the distance travelled, from a given speed if there is one, else on the road."""

from dataclasses import replace
import math

from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.path.speed import SpeedTrack
from phase_traj_ros.core.road.camera_height import CameraHeight
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.road.tuning import TUNING
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.core.settings import EstimatorSettings
from phase_traj_ros.core.status import PairStatus


class DistanceMeter:
    """Measures the distance of each pair, in the unit of the path (see ``Travel``)."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a meter before the first frame."""
        self._settings = settings
        self.speeds = SpeedTrack(max_speeds=settings.max_speeds)
        """Given speeds of the vehicle."""
        self._height = CameraHeight(settings.camera_height, settings.camera_height_deviation)
        self.heights_per_second: float | None = None
        """Newest speed in heights of the camera per second, 0 or more; None if it is unknown."""
        self._meter: RoadMeter | None = None
        self._form: tuple[Lens, tuple[int, ...], bool] | None = None

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Continue with other settings; speeds and height are kept."""
        self._settings = settings

    def reset(self) -> None:
        """Restart with the next frame; the height of the camera is kept."""
        self.heights_per_second = None
        if self._meter is not None:
            self._meter.forget()

    def start(self, frame: Frame, camera: YawCamera | None) -> None:
        """Add a frame that is the first of a pair."""
        if camera is not None and self._measures_road:
            self._update_camera(frame, camera)
            if self._meter is not None:
                self._meter.start(frame)

    def update(
        self, frame: Frame, camera: YawCamera | None, measured: YawMeasurement | None,
        status: PairStatus, stamp_ns: int, interval_ns: int, *, interval_deviation: float = 0.0,
    ) -> Travel | None:
        """
        Add the next frame, (H, W), and return the distance of its pair; None if it has none.

        The frame must not change afterwards. Without a camera, no distance is measured;
        ``measured`` is None if the frames cannot be compared. ``interval_ns`` is the time since
        the previous frame, ``interval_deviation`` its standard deviation in seconds.
        """
        if camera is None or not self._settings.measures_distance:
            return None
        interval = interval_ns * 1e-9
        on_road = None
        if self._meter is not None:
            on_road = self._meter.update(
                frame, interval, None if measured is None else measured.motion,
                yaw=None if measured is None else measured.yaw, still=status is PairStatus.STILL,
                interval_deviation=interval_deviation)
            if on_road.state is TravelState.UNKNOWN and not status.judged:
                on_road = replace(on_road, distance=0.0)
            on_road = on_road.scaled(1.0, camera.lens.focal_deviation)
        self.heights_per_second = (
            abs(on_road.distance) / interval if on_road is not None and on_road.known else None)
        if self._measures_road and self._update_camera(frame, camera) and self._meter is not None:
            self._meter.start(frame)
        if not self._settings.metric:
            return on_road
        given = self._given_distance(status, stamp_ns, interval_ns)
        if given is not None:
            self.heights_per_second = abs(given) / (
                interval * (self._height.metres or TUNING.usual_height))
            if (given > 0.0 and on_road is not None and on_road.state is TravelState.MEASURED
                    and on_road.distance > TUNING.min_calibration_speed * interval):
                self._height.add(given, on_road.distance, interval)
            return Travel(
                given, (TUNING.given_speed_error * given) ** 2, TravelState.GIVEN,
                scale=TUNING.given_speed_error)
        height = self._height.metres
        if on_road is None or height is None or on_road.state is TravelState.UNKNOWN:
            deviation = TUNING.unknown_speed_deviation * TUNING.usual_height * interval
            return Travel(
                0.0, deviation ** 2, TravelState.UNKNOWN,
                rivalled=on_road is not None and on_road.rivalled)
        return on_road.scaled(height, self._height.deviation)

    def reaches(self, seconds: float) -> bool:
        """Return whether the road can still be compared ``seconds`` after the newest pair."""
        if self._meter is None:
            return True
        speed = self.heights_per_second or 0.0
        return (not self._meter.needs_every_frame
                and speed * seconds <= TUNING.max_foreseen_slide)

    @property
    def _measures_road(self) -> bool:
        """Return whether the distance is measured on the road; a constant speed replaces it."""
        return self._settings.measures_distance and self._settings.speed == 0.0

    def _given_distance(self, status: PairStatus, stamp_ns: int, interval_ns: int) -> float | None:
        """Return the distance in metres by a given speed; None without a speed."""
        if self._settings.awaits_speeds:
            return self.speeds.distance(stamp_ns - interval_ns, stamp_ns)
        if self._settings.speed == 0.0:
            return None
        return 0.0 if status is PairStatus.STILL else self._settings.speed * interval_ns * 1e-9

    def _update_camera(self, frame: Frame, camera: YawCamera) -> bool:
        """Use the current camera and mask; return whether the camera has changed."""
        lens = camera.lens
        form = (lens, frame.shape, self._settings.view.rotate_180)
        if form == self._form and self._meter is not None:
            self._meter.use_mask(camera.pixel_weights)
            return False
        speeds = None if self._meter is None else self._meter.speed_filter
        if speeds is not None:
            speeds.deviation += TUNING.lens_change_error * abs(speeds.speed)
        self._form = form
        horizon, given = lens.horizon, math.radians(self._settings.camera_pitch_deg)
        self._meter = RoadMeter(
            camera.model, replace(horizon, pitch=given) if given else horizon,
            pitch_known=lens.pitch_known or given != 0.0,
            rotate_180=self._settings.view.rotate_180, mask=camera.pixel_weights,
            speed_filter=speeds)
        return True
