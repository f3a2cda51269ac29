# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measures the yaw between frames by phase correlation on the cylinder and a fit to its blocks.

Phase correlation measures the shift of the image as a whole. On a road, this is the yaw plus
parallax: objects at the roadside pass by, more on one side than on the other, and in a turn the
camera itself moves sideways. The shift is therefore the start value for the blocks of a grid. The
yaw is the part of their displacements that does not depend on their distance.
"""

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.rotation.camera_motion import CameraMotion, MotionFit, quantile
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.keyframe import Keyframe
from phase_traj_ros.core.rotation.local_shifts import BlockGrid, BlockShifts
from phase_traj_ros.core.rotation.scanline import Scanline
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.whole_shift import WholeShift
from phase_traj_ros.errors import FrameError


@dataclass(frozen=True, slots=True)
class YawMeasurement:
    """
    Yaw measurement of one pair of frames.

    shift
        Shift of the image as a whole, in pixels of the cylinder.
    yaw
        Yaw in radians, positive to the left; None if it could not be measured.
    refined
        Whether the yaw comes from the blocks. If the blocks do not agree (for example, because
        the vehicle moved too far between the two frames), it comes from the shift alone.
    agreement
        Share of the blocks that agree, 0 to 1.
    motion
        Rotation since the previous frame, and direction of travel; None unless the yaw is refined.
    share
        Share of the pair in the time since the keyframe from which it was measured.
    common
        Standard deviation of the error that all blocks have in common, in radians.
    """

    shift: Shift
    yaw: float | None
    refined: bool
    agreement: float
    motion: CameraMotion | None = None
    share: float = 1.0
    common: float = 0.0

    @property
    def variance(self) -> float:
        """Return the variance of the yaw in square radians, from the scatter of the blocks."""
        if self.motion is None:
            own = TUNING.shift_deviation ** 2
        else:
            # Where few blocks agree, they agree on something wrong, too.
            doubt = max(TUNING.doubted_share / self.motion.agreement, 1.0)
            own = self.motion.yaw_variance * doubt ** 2
        return self.share * (own + self.common ** 2)

    @property
    def certain(self) -> bool:
        """Return whether most of the blocks agree on the yaw."""
        return self.refined and self.agreement >= TUNING.doubted_share


@dataclass(frozen=True, slots=True)
class _Seen:
    """The motion since a keyframe, and the displacements of the blocks that it follows from."""

    key: Keyframe
    motion: CameraMotion
    blocks: BlockShifts


class YawMeter:
    """Measures the yaw between each frame and the previous one."""

    def __init__(
        self, projection: CylinderProjection, *, mask: NDArray[np.float32] | None = None,
        keyframes: bool = True,
    ) -> None:
        """
        Make a meter for frames of the size of ``projection``.

        ``mask`` is the weight of each pixel of the frames, (H, W), 0 to 1; None if all count
        equally. Without ``keyframes``, each frame is compared with its predecessor.

        Raises
        ------
        FrameError
            The size of the mask differs from that of the frames, or the mask covers too much.

        """
        self._projection = projection
        self._keyframes = keyframes
        mask, counts = self._projected(mask)
        self._grid = BlockGrid(counts)
        if len(self._grid.middles) < TUNING.least_blocks:
            raise FrameError('the mask covers too much of the frames to measure yaw: give one'
                             ' that covers less')
        self._whole = WholeShift(projection, mask)
        # The mask to use from the next frame on, in a tuple; None if it does not change.
        self._next_mask: tuple[NDArray[np.float32] | None] | None = None
        columns, rows = self._grid.middles.T
        scale = projection.px_per_rad
        azimuths = np.interp(columns, np.arange(projection.shape[1]), projection.azimuths)
        slopes = np.interp(rows, np.arange(projection.shape[0]), projection.slopes)
        self._fit = MotionFit(azimuths, slopes, deviation=TUNING.block_deviation_px / scale)
        self._low = slopes > TUNING.road_slope
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next frame is the first."""
        self._whole.reset()
        self._grid.forget()
        self._previous: NDArray[np.uint8] | None = None
        self._key: Keyframe | None = None
        self._brightness: float | None = None
        self._rate = 0.0
        # The newest frame and its line, if the next ones may be foreseen, and the median ratio of
        # translation to distance of the blocks per second.
        self._newest: NDArray[np.uint8] | None = None
        self._line: Scanline | None = None
        self._passing = 0.0
        self.mounting = Mounting()
        """Direction in which a vehicle with this camera drives straight ahead."""

    def use_mask(self, mask: NDArray[np.float32] | None) -> None:
        """
        Continue with another mask, in the form of the first one, from the next frame on.

        No pair is lost. It can only remove areas from those of the first mask. A mask that covers
        too much to measure yaw is not used.
        """
        # Until then, the map of the newest pair must be available.
        self._next_mask = (mask,)

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the map of the newest pair; see ``PhaseCorrelator.correlation_map``."""
        return self._whole.correlation_map()

    def foresees(self, frame: NDArray[np.uint8], waited: float, interval: float) -> bool:
        """
        Return whether a frame (H, W) needs no measurement, as it shows the motion that goes on.

        It comes ``waited`` seconds after the newest one that was measured, and the next one is
        expected ``interval`` seconds later: that one must not come too late for the measurement.
        """
        later = waited + interval
        if (self._newest is None or self._key is None or later > TUNING.foreseen_s
                or not self._key.reaches(self._passing, self._rate, later)):
            return False
        if self._line is None:
            self._line = Scanline(self._projection, self._newest)
        aside = self._line.moved_aside(frame, self._rate * waited * self._projection.px_per_rad)
        return aside is not None and abs(aside) <= TUNING.aside_px

    @property
    def foreseen_deviation(self) -> float:
        """Return the standard deviation in radians of a yaw that is foreseen."""
        return TUNING.aside_px / 2 / self._projection.px_per_rad

    def update(self, frame: NDArray[np.uint8], interval: float) -> YawMeasurement | None:
        """
        Return the yaw from the previous frame to ``frame``, (H, W), or None for the first frame.

        ``interval`` is the time since the previous frame in seconds, above 0; it is not used for
        the first frame.

        Raises
        ------
        FrameError
            The frame cannot be used. The state is unchanged.

        """
        if self._next_mask is not None:
            self._change_mask(*self._next_mask)
        projected = cast('NDArray[np.uint8]', self._projection(frame))
        shift = self._whole.update(projected)
        current = self._levelled(projected)
        previous, self._previous = self._previous, current
        self._newest = self._line = None
        key = self._key
        if previous is None or key is None or shift is None or interval <= 0.0:
            self._key, self._rate = self._keyframe(current, FocusOfExpansion()), 0.0
            return None
        key.age += interval
        seen = self._since_key(key, previous, current, shift, interval)
        if seen is None or not seen.motion.holds(TUNING.confirmed_share):
            self._key = self._keyframe(current, key.travel)
            return self._by_shift(shift, self._of_scene(shift, interval), seen, interval)
        if not (seen.motion.holds(TUNING.least_agreement)
                or self._confirms(self._of_scene(shift, interval), seen)):
            self._key = self._keyframe(current, key.travel)
            return self._by_shift(shift, None, seen, interval)
        measured = self._by_blocks(shift, seen, interval)
        if self._keyframes and measured.certain:
            self._newest = frame
        over = not self._keyframes or seen.key.is_over(seen.motion, interval)
        self._key = self._keyframe(current, seen.key.travel) if over else seen.key
        return measured

    def _since_key(
        self, key: Keyframe, previous: NDArray[np.uint8], current: NDArray[np.uint8],
        shift: Shift, interval: float,
    ) -> _Seen | None:
        """Compare a frame with the keyframe, or if too little agrees, with the previous frame."""
        if shift.response <= 0.0:
            return None
        seen = self._search(key, current, shift, interval)
        if key.age > interval and (seen is None or seen.motion.agreement < TUNING.nearer_share):
            nearer = self._keyframe(previous, key.travel)
            nearer.age = interval
            other = self._search(nearer, current, shift, interval)
            if seen is None or (
                    other is not None and other.motion.agreement > seen.motion.agreement):
                return other
        return seen

    def _foreseen(self, interval: float) -> float:
        """Return the shift at the rate of the previous pair, in pixels."""
        farthest = self._projection.shape[1] / 2
        foreseen = self._rate * interval * self._projection.px_per_rad
        return min(max(foreseen, -farthest), farthest)

    def _search(
        self, key: Keyframe, current: NDArray[np.uint8], shift: Shift, interval: float,
    ) -> _Seen | None:
        """
        Search the blocks around the shift, and around other values if the shift is doubted.

        A pattern that is fixed to the camera pulls the shift to zero; then the second peak is that
        of the scene. After a wrong peak, the yaw rate of the previous pair gives the start value.
        """
        foreseen = self._foreseen(interval)
        shaking = min(max(shift.dy, -TUNING.most_shake_px), TUNING.most_shake_px)
        best = self._look(key, current, (shift.dx, shaking))
        if (best is None or not best.motion.certain
                or abs(shift.dx - foreseen) > TUNING.surprise_px):
            best = _best(best, self._look(key, current, (foreseen, 0.0)))
        if best is None or not best.motion.certain:
            second = self._whole.second_peak()
            best = _best(best, self._look(key, current, (second.dx, 0.0)))
        if best is not None and best.motion.holds(TUNING.least_agreement):
            turned = best.motion.yaw * self._projection.px_per_rad
            self._grid.learn(best.blocks, self._must_move(best.blocks, turned))
        return best

    def _must_move(self, blocks: BlockShifts, turned: float) -> NDArray[np.bool_]:
        """Return in which blocks any part of the scene must have moved."""
        if abs(turned) > TUNING.all_move_px:
            return np.ones(len(self._low), np.bool_)
        # Straight ahead, distant parts of the scene do not move; the road is near, and does.
        driving = quantile(np.hypot(blocks.dx, blocks.dy), 0.5) > TUNING.road_moves_px
        return self._low if driving else np.zeros_like(self._low)

    def _look(
        self, key: Keyframe, current: NDArray[np.uint8], expected: tuple[float, float],
    ) -> _Seen | None:
        scale = self._projection.px_per_rad
        blocks = self._grid.measure(key.picture, current, expected=key.moved + np.array(expected))
        motion = self._fit(
            blocks.dx / scale, blocks.dy / scale, blocks.weight,
            key.foreseen(self._rate, self.mounting), aside=key.picture.aside / scale,
            down=key.picture.down / scale, precision=blocks.precision)
        return None if motion is None else _Seen(key, motion, blocks)

    def _by_blocks(self, shift: Shift, seen: _Seen, interval: float) -> YawMeasurement:
        """Return the measurement of a pair by the motion since the keyframe, and learn from it."""
        key, motion = seen.key, seen.motion
        pair = key.pair(motion, seen.blocks)
        self._rate = pair.yaw / interval
        # The direction of travel of blocks that hardly agree could run away.
        key.travel = (motion.travel if motion.certain
                      else motion.travel.limited(self._rate, self.mounting))
        self._passing = motion.passing / key.age
        if motion.passing > TUNING.moving:
            self.mounting.add(
                motion.travel.course, motion.travel.course_variance, interval, self._rate)
        return YawMeasurement(
            shift, pair.yaw, True, motion.agreement, pair, interval / key.age,
            common=max(TUNING.common_deviation, TUNING.common_px / self._projection.px_per_rad))

    def _of_scene(self, shift: Shift, interval: float) -> Shift | None:
        """Return the shift of the scene; None if nothing stands out."""
        unmoved = max(abs(shift.dx), abs(shift.dy)) <= TUNING.unmoved_px
        if unmoved and abs(self._foreseen(interval)) > TUNING.surprise_px / 2:
            # It is that of a pattern that is fixed to the camera.
            shift = self._whole.second_peak()
        stands_out = self._whole.significance(shift) >= TUNING.least_significance
        return shift if stands_out and abs(shift.dy) < TUNING.most_shake_px else None

    def _confirms(self, scene: Shift | None, seen: _Seen) -> bool:
        """Return whether the shift of the scene confirms a motion with which few blocks agree."""
        # The shift is that since the previous frame.
        yaw = seen.motion.yaw - seen.key.turned
        tolerance = max(
            TUNING.outlier_deviations * TUNING.shift_deviation, TUNING.confirmed_near * abs(yaw))
        return scene is not None and (
            abs(scene.dx / self._projection.px_per_rad - yaw) <= tolerance)

    def _by_shift(
        self, shift: Shift, scene: Shift | None, seen: _Seen | None, interval: float,
    ) -> YawMeasurement:
        """Return the measurement of a pair by the shift alone, where the blocks tell nothing."""
        yaw = None
        if scene is not None:
            yaw = scene.dx / self._projection.px_per_rad
            self._rate = yaw / interval
        return YawMeasurement(shift, yaw, False, 0.0 if seen is None else seen.motion.agreement)

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

    def _change_mask(self, mask: NDArray[np.float32] | None) -> None:
        self._next_mask = None
        projected, counts = self._projected(mask)
        if not self._grid.look_at(counts, least=TUNING.least_blocks):
            return
        self._whole = WholeShift(self._projection, projected)
        if self._previous is not None:
            self._whole.update(self._previous)

    def _keyframe(self, picture: NDArray[np.uint8], travel: FocusOfExpansion) -> Keyframe:
        return Keyframe(self._grid.take(picture), travel)

    def _levelled(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the image without sudden changes of exposure."""
        brightness = cv2.mean(picture)[0]
        if self._brightness is None:
            self._brightness = brightness
        gain = self._brightness / brightness if brightness > 0.0 else 1.0
        self._brightness += TUNING.brightness_share * (brightness - self._brightness)
        return cv2.convertScaleAbs(picture, alpha=gain)  # type: ignore[return-value]


def _best(*seen: _Seen | None) -> _Seen | None:
    """Return the motion with which most blocks agree."""
    return max(filter(None, seen), key=lambda each: each.motion.agreeing, default=None)
