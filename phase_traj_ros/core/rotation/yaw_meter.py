# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measures the yaw between frames by phase correlation on the cylinder and a fit to its blocks.

Phase correlation measures the shift of the image as a whole, which is the yaw plus parallax. It is
the start value for the blocks of a grid. The yaw is the part of their displacements that does not
depend on their distance.
"""

from dataclasses import dataclass
from functools import partial
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.rotation.block_matcher import BlockMatcher, Keyframe, Match
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.camera_roll import CameraRoll
from phase_traj_ros.core.rotation.cross_traffic import CrossTraffic
from phase_traj_ros.core.rotation.focus_of_expansion import Mounting
from phase_traj_ros.core.rotation.scanline import Scanline
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.whole_shift import WholeShift


@dataclass(frozen=True, slots=True)
class YawMeasurement:
    """
    Yaw measurement of one pair of frames.

    shift
        Shift of the image as a whole, in pixels of the cylinder (see ``YawCamera.measure``).
    yaw
        Yaw in radians, positive to the left; None if it could not be measured.
    agreement
        Share of the blocks that agree, 0 to 1.
    motion
        Rotation of the camera since the previous frame, and direction of travel. Unlike ``yaw``,
        it includes the yaw that comes from a lean. None if the blocks do not agree, for example
        because the vehicle moved too far: then the yaw comes from the shift alone.
    share
        Share of the pair in the time since the keyframe from which it was measured.
    common
        Standard deviation of the error that all blocks have in common, in radians.
    is_traffic
        Whether the blocks move with traffic that crosses close in front of a standing vehicle.
    """

    shift: Shift
    yaw: float | None
    agreement: float
    motion: CameraMotion | None = None
    share: float = 1.0
    common: float = 0.0
    is_traffic: bool = False

    @property
    def variance(self) -> float:
        """Return the variance of the yaw in square radians, from the scatter of the blocks."""
        if self.motion is None:
            own = TUNING.shift_deviation ** 2
        else:
            # If few blocks agree, their motion may be wrong.
            doubt = max(TUNING.doubted_share / self.motion.agreement, 1.0)
            own = self.motion.yaw_variance * doubt ** 2
        return self.share * (own + self.common ** 2)

    @property
    def reverses(self) -> bool | None:
        """Return whether the vehicle moves backwards; None if the blocks do not show it."""
        near = 0.0 if self.motion is None else self.motion.near
        return near < 0.0 if near else None

    @property
    def certain(self) -> bool:
        """Return whether most of the blocks agree on the yaw."""
        return self.motion is not None and self.motion.certain


class YawMeter:
    """Measures the yaw between each frame and the previous one."""

    def __init__(
        self, projection: CylinderProjection, *, mask: NDArray[np.float32] | None = None,
        mounting: Mounting | None = None, roll: CameraRoll | None = None,
    ) -> None:
        """
        Make a meter for frames of the size of ``projection``.

        ``mask`` is the weight of each pixel of the frames, (H, W), 0 to 1; None if all count
        equally. ``mounting`` and ``roll`` are those of the camera, if they are known from earlier
        frames; the azimuth of ``mounting`` is reset.

        Raises
        ------
        FrameError
            The mask covers too much.

        """
        self._projection = projection
        self.mounting = mounting or Mounting()
        """Direction in which a vehicle with this camera drives straight ahead."""
        mask, counts = self._projected(mask)
        self._matcher = BlockMatcher(projection, counts)
        self._whole_shift = WholeShift(projection, mask)
        # The correlation to use from the next frame on, if the mask has changed.
        self._next_shift: WholeShift | None = None
        self.roll = roll or CameraRoll(Horizon())
        """Roll of the camera, relative to the vertical and to the road."""
        self._restart()

    def reset(self) -> None:
        """Forget everything but the tilt of the camera: the next frame is the first."""
        self._restart()
        self.roll.forget_lean()

    def _restart(self) -> None:
        self._whole_shift.correlator.reset()
        self._matcher.grid.forget()
        self._previous: NDArray[np.uint8] | None = None
        self._key: Keyframe | None = None
        self._brightness: float | None = None
        self._rate = 0.0
        # The newest frame and its line, if the next ones may be foreseen, and the median ratio of
        # translation to distance of the blocks per second.
        self._newest: NDArray[np.uint8] | None = None
        self._scanline: Scanline | None = None
        self._passing = 0.0
        self._traffic = CrossTraffic(still=TUNING.fixed_px / self._projection.px_per_rad)
        self._speed: float | None = None
        self.mounting.forget_azimuth()

    def use_mask(self, mask: NDArray[np.float32] | None) -> None:
        """
        Continue with another mask, in the form of the first one, from the next frame on.

        No pair is lost. It can only remove areas of the first mask. A mask that covers too much to
        measure yaw is ignored.
        """
        mask, counts = self._projected(mask)
        if self._matcher.grid.use_mask(counts):
            # Until the next frame, the map of the newest pair must be available.
            self._next_shift = WholeShift(self._projection, mask)

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the map of the newest pair; see ``PhaseCorrelator.correlation_map``."""
        return self._whole_shift.correlator.correlation_map()

    def foresees(self, frame: NDArray[np.uint8], waited: float, interval: float) -> bool:
        """
        Return whether a frame (H, W) needs no measurement, as the motion continues.

        It comes ``waited`` seconds after the newest measured frame. The next frame, expected
        ``interval`` seconds later, must not be too late for a measurement.
        """
        later = waited + interval
        if (self._newest is None or self._key is None or later > TUNING.max_foreseen_s
                or not self._key.is_near(self._passing, self._rate, later)):
            return False
        if self._scanline is None:
            self._scanline = Scanline(self._projection, self._newest)
        foreseen = self._rate * waited * self._projection.px_per_rad
        error = self._scanline.shift_error(frame, foreseen)
        return error is not None and abs(error) <= TUNING.foreseen_tolerance_px

    def update(
        self, frame: NDArray[np.uint8], interval: float, *, speed: float | None = None,
    ) -> YawMeasurement | None:
        """
        Return the yaw from the previous frame to ``frame``, (H, W), or None for the first frame.

        ``interval`` is the time since the previous frame in seconds, above 0; it is not used for
        the first frame. ``speed`` is that before the pair in camera heights per second, None if it
        is unknown, negative in reverse: at rest, traffic is recognised, and when driving, drops on
        the windscreen. The blocks may show reverse only if a known speed is negative.

        Raises
        ------
        FrameError
            The frame cannot be used. The state is unchanged.

        """
        if self._next_shift is not None:
            self._whole_shift, self._next_shift = self._next_shift, None
            if self._previous is not None:
                self._whole_shift.update(self._previous)
        projected = cast('NDArray[np.uint8]', self._projection(frame))
        shift = self._whole_shift.update(projected)
        current = self._level_exposure(projected)
        previous, self._previous = self._previous, current
        self._newest = self._scanline = None
        key = self._key
        if previous is None or key is None or shift is None or interval <= 0.0:
            self._key = self._matcher.keyframe(current, self.mounting.straight_ahead)
            self._rate = 0.0
            return None
        key.age += interval
        self.roll.predict(interval)
        self._speed = speed
        match = self._match_keyframe(key, previous, current, shift, interval)
        scene = None
        if match is not None and speed and _may_show_drops(match.motion):
            scene = self._shift_beside(match, shift)
        if scene is not None or match is None or not match.motion.holds(TUNING.confirmed_share):
            self._key = self._matcher.keyframe(current, key.travel)
            return self._by_shift(
                shift, scene or self._scene_shift(shift, interval), match, interval)
        if not (match.motion.holds(TUNING.min_agreement)
                or self._confirms(self._scene_shift(shift, interval), match)):
            self._key = self._matcher.keyframe(current, key.travel)
            return self._by_shift(shift, None, match, interval)
        measured = self._by_blocks(shift, match, interval)
        if measured.certain:
            self._newest = frame
        # If the previous frame agreed better, the frame after the next would be too far again.
        over = (match.key is not key or self._is_traffic
                or match.key.has_expired(match.motion, interval))
        self._key = self._matcher.keyframe(current, match.key.travel) if over else match.key
        return measured

    def _match_keyframe(
        self, key: Keyframe, previous: NDArray[np.uint8], current: NDArray[np.uint8],
        shift: Shift, interval: float,
    ) -> Match | None:
        """Compare a frame with the keyframe, or if fewer blocks agree, with the previous one."""
        if shift.response <= 0.0:
            return None
        match = self._search(key, current, shift, interval)
        if key.age > interval and (
                match is None
                or match.motion.agreement < TUNING.kept_agreement * key.agreement):
            nearer = self._matcher.keyframe(previous, key.travel)
            nearer.age = interval
            other = self._search(nearer, current, shift, interval)
            if match is None or (
                    other is not None and other.motion.agreement > match.motion.agreement):
                return other
        return match

    def _foreseen(self, interval: float) -> float:
        """Return the shift at the rate of the previous pair, in pixels."""
        farthest = self._projection.shape[1] / 2
        foreseen = self._rate * interval * self._projection.px_per_rad
        return min(max(foreseen, -farthest), farthest)

    def _search(
        self, key: Keyframe, current: NDArray[np.uint8], shift: Shift, interval: float,
    ) -> Match | None:
        """
        Search the blocks around the shift and, if that is in doubt, around other values.

        These are the shift at the previous yaw rate, and the second peak: that of the scene if the
        first one belongs to a pattern fixed to the camera.
        """
        foreseen = self._foreseen(interval)
        shaking = min(max(shift.dy, -TUNING.max_shake_px), TUNING.max_shake_px)
        travel = key.predict_travel(self._rate, self.mounting)
        match = partial(self._matcher.match, key, current, travel,
                        reverses=self._speed is None or self._speed < 0.0)
        best = match((shift.dx, shaking))
        if (best is None or not best.motion.certain
                or abs(shift.dx - foreseen) > TUNING.shift_gate_px):
            best = _best(best, match((foreseen, 0.0)))
        if best is None or not best.motion.certain:
            second = self._whole_shift.second_peak()
            best = _best(best, match((second.dx, 0.0)))
        if (best is not None and best.motion.holds(TUNING.min_agreement)
                and not (self._stood and self._traffic.explains(
                    best.motion, best.blocks.resting))):
            self._matcher.learn(best)
        return best

    def _by_blocks(self, shift: Shift, match: Match, interval: float) -> YawMeasurement:
        """Return the measurement of a pair by the motion since the keyframe, and learn from it."""
        key, motion = match.key, match.motion
        self._traffic.update(
            motion, match.blocks.resting, moving=match.blocks.moving, stood=self._stood)
        pair = key.add(motion, match.blocks, roll=self.roll.current)
        self._rate = pair.yaw / interval
        self._passing = motion.passing / key.age
        swung = self.roll.add(pair, interval, self.mounting,
                              certain=motion.certain and not self._is_traffic)
        if not self._is_traffic:
            self._learn_travel(key, motion, interval)
        return YawMeasurement(
            shift, pair.yaw - swung, motion.agreement, pair, interval / key.age,
            common=max(TUNING.common_error, TUNING.common_error_px / self._projection.px_per_rad),
            is_traffic=self._is_traffic)

    def _learn_travel(self, key: Keyframe, motion: CameraMotion, interval: float) -> None:
        """Learn the direction of travel since the keyframe, if the blocks show it."""
        if motion.passing <= TUNING.min_passing:
            # On the spot, their errors would turn it aside.
            key.travel = key.predict_travel(self._rate, self.mounting)
            return
        # It could diverge if few blocks agree.
        key.travel = (motion.travel if motion.certain
                      else motion.travel.limited(self._rate, self.mounting))
        self.mounting.add(motion.travel, interval, self.roll.yaw_rate)

    @property
    def _stood(self) -> bool:
        return self._speed == 0.0

    @property
    def _is_traffic(self) -> bool:
        return self._stood and self._traffic.crosses

    def _scene_shift(self, shift: Shift, interval: float) -> Shift | None:
        """Return the shift of the scene; None if no shift is significant."""
        turns = abs(self._foreseen(interval)) > TUNING.shift_gate_px / 2
        return self._whole_shift.of_scene(shift, moves=turns)

    def _shift_beside(self, match: Match, shift: Shift) -> Shift | None:
        """Return the shift of a scene that turns while the blocks rest; None if there is none."""
        scene = self._whole_shift.of_scene(shift, moves=True)
        yaw = self._projection.px_per_rad * (match.motion.yaw - match.key.yaw)
        beside = (scene is not None and abs(scene.dx - yaw) > max(abs(yaw), TUNING.zero_px)
                  and abs(scene.dy) <= TUNING.zero_px)
        return scene if beside else None

    def _confirms(self, scene: Shift | None, match: Match) -> bool:
        """Return whether the shift of the scene confirms a motion with which few blocks agree."""
        # The shift is that since the previous frame.
        yaw = match.motion.yaw - match.key.yaw
        tolerance = max(
            TUNING.outlier_deviations * TUNING.shift_deviation,
            TUNING.confirmation_tolerance * abs(yaw))
        return scene is not None and (
            abs(scene.dx / self._projection.px_per_rad - yaw) <= tolerance)

    def _by_shift(
        self, shift: Shift, scene: Shift | None, match: Match | None, interval: float,
    ) -> YawMeasurement:
        """Return the measurement of a pair by the shift alone."""
        yaw = None
        if scene is not None:
            yaw = scene.dx / self._projection.px_per_rad
            self._rate = yaw / interval
        self.roll.miss(interval, yaw or 0.0)
        return YawMeasurement(
            shift, yaw, 0.0 if match is None else match.motion.agreement,
            is_traffic=self._is_traffic)

    def _projected(
        self, mask: NDArray[np.float32] | None,
    ) -> tuple[NDArray[np.float32] | None, NDArray[np.bool_]]:
        """Return the mask on the cylinder, and where the centre of a block may be."""
        counts = self._projection.inside
        if mask is None:
            return None, counts
        mask = np.asarray(self._projection(mask), np.float32)
        counts = counts & (cv2.erode(mask, np.ones((TUNING.block_px,) * 2)) > 0.5)
        return mask, counts

    def _level_exposure(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the image without sudden changes of exposure."""
        brightness = cv2.mean(picture)[0]
        if self._brightness is None:
            self._brightness = brightness
        gain = self._brightness / brightness if brightness > 0.0 else 1.0
        self._brightness += TUNING.exposure_rate * (brightness - self._brightness)
        return cv2.convertScaleAbs(picture, alpha=gain)  # type: ignore[return-value]


def _may_show_drops(motion: CameraMotion) -> bool:
    """Return whether few of the blocks agree, on a motion that passes nothing."""
    return (not motion.certain and motion.holds(TUNING.confirmed_share)
            and motion.passing < TUNING.min_passing)


def _best(*matches: Match | None) -> Match | None:
    """Return the motion with which most blocks agree."""
    return max(filter(None, matches), key=lambda each: each.motion.agreeing, default=None)
