# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures heading and turns from the frames of a camera whose lens is given or learned."""

from dataclasses import dataclass
import math

from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.heading.tracker import HeadingStep, HeadingTracker
from phase_traj_ros.core.heading.tuning import TUNING
from phase_traj_ros.core.heading.turns import Turn, TurnDetector
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement


@dataclass(frozen=True, slots=True)
class HeadingUpdate:
    """Heading and turns of one pair of frames."""

    step: HeadingStep
    turns: tuple[Turn, ...] = ()
    """Turns whose end was detected with this pair."""
    quarters: tuple[int, ...] = ()
    """Quarter turns that count from this pair on, in order: 1 to the left, -1 to the right."""
    contradicts: bool = False
    """Whether the direction that the quarter turns give contradicts the heading."""


class VisualCompass:
    """Measures the yaw of each pair, integrates it to the heading, and detects turns."""

    def __init__(self, camera: YawCamera) -> None:
        """Make a compass at heading 0, for the yaws that ``camera`` measures."""
        self.camera = camera
        """Camera, which measures the yaw."""
        self.restart()

    @property
    def lacks_camera(self) -> bool:
        """Return whether the camera is not known well enough for the turns so far."""
        camera = self.camera.in_use
        if camera is None:
            return False
        widest = self._turns.widest_deg
        may_turn = self._has_turned or widest * camera.most_angle >= TUNING.turn_deg
        # The quarter turns of a wide bend need a better camera.
        in_doubt = widest * (camera.most_angle - 1.0) > TUNING.quarter_error_deg
        return in_doubt or (may_turn and not camera.settled)

    def use_lens(self, lens: Lens) -> None:
        """
        Continue with another lens; the heading is corrected if the previous one was a guess.

        The next frame becomes the first of a pair. An equal lens has no effect.
        """
        self._correct(self.camera.use_lens(lens))

    def cut(self) -> None:
        """
        Start a new scene with the pair that is added next.

        The heading and the turns are kept; a turn in progress ends.
        """
        self.tracker.cut()
        self._turns.cut()

    def restart(self) -> None:
        """Restart at heading 0 with the newest frame; a learned camera is kept."""
        self.tracker = HeadingTracker(self.camera.lens.focal_deviation)
        """Tracker, which integrates the yaw."""
        self._turns = TurnDetector()
        self._has_turned = False

    def finish(self) -> list[Turn]:
        """Return the turn in progress at the end, if it has reached the minimum angle."""
        self.camera.finish()
        return self._turns.finish()

    def foresee(self, waited: float) -> HeadingUpdate:
        """Return the update of a frame that is foreseen, ``waited`` seconds after the newest."""
        return HeadingUpdate(self.tracker.foresee(waited, self.camera.foreseen_deviation))

    def admits(self, measurement: YawMeasurement | None, interval: float) -> bool:
        """Return whether ``add`` would accept the yaw of a measurement; False without a yaw."""
        return measurement is not None and measurement.yaw is not None and self.tracker.admits(
            measurement.yaw / self.camera.tilt, interval, certain=measurement.certain)

    def start(self, stamp_ns: int) -> None:
        """Record the stamp of the first frame."""
        self._turns.update(stamp_ns, 0.0)
        self._correct(self.camera.learn(stamp_ns))

    def add(
        self, measurement: YawMeasurement | None, stamp_ns: int, interval: float, *,
        distance: float | None = None, frames: int = 1,
    ) -> HeadingUpdate:
        """
        Add the measurement of a pair; None bridges the pair.

        ``distance`` is that of the pair in camera heights, 0 or more; None if unknown.
        ``frames`` is the number of frames since the previous pair.
        """
        if measurement is None:
            step = self.tracker.update(None, interval)
        else:
            yaw, tilt = measurement.yaw, self.camera.tilt
            step = self.tracker.update(
                None if yaw is None else yaw / tilt, interval, certain=measurement.certain,
                variance=measurement.variance / tilt ** 2, share=measurement.share)
        turns = self._turns.update(stamp_ns, step.heading, distance, rate=step.rate, frames=frames)
        update = HeadingUpdate(
            step, tuple(turns), self._turns.quarters, self._contradicts(step.heading))
        self._has_turned |= bool(update.quarters or update.turns)
        self._correct(self.camera.learn(stamp_ns))
        return update

    def _contradicts(self, heading: float) -> bool:
        """Return whether the direction and the heading differ by more than their errors."""
        own = math.hypot(self.camera.lens.focal_deviation * heading, self.tracker.deviation)
        return math.radians(self._turns.direction_error_deg) > max(
            math.radians(TUNING.turn_deg), TUNING.contradiction_deviations * own)

    def _correct(self, factor: float | None) -> None:
        """Correct all angles so far by a factor, as the lens has changed; None if it has not."""
        if factor is not None:
            self.tracker.scale(factor)
            self._turns.scale(factor)
            self.tracker.scale_deviation = self.camera.lens.focal_deviation
