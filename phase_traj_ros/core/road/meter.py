# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measures the distance travelled in camera heights, from the displacement of the road surface.

A near and a far patch of the road are projected to a bird's-eye view. The rotation of the camera,
known from the blocks of the heading, is removed. The remaining motion of a patch is a translation
towards the vehicle. It is measured from a keyframe, which is up to half a second old.
"""

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.road.ground import CELL, rotation
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.patch_matcher import RoadSlide, slide_scale
from phase_traj_ros.core.road.speed_filter import SpeedFilter
from phase_traj_ros.core.road.speed_profile import SpeedProfile
from phase_traj_ros.core.road.standstill import Standstill
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.road.tuning import TUNING
from phase_traj_ros.core.road.view import RoadView
from phase_traj_ros.core.rotation.camera_motion import CameraMotion, running_mean
from phase_traj_ros.core.rotation.camera_pitch import CameraPitch


class RoadMeter:
    """Measures the distance that a camera travels between frames."""

    def __init__(
        self, camera: CameraModel, horizon: Horizon, *, mask: NDArray[np.float32] | None = None,
        speed_filter: SpeedFilter | None = None, pitch: CameraPitch | None = None,
    ) -> None:
        """
        Make a meter that waits for its first frame.

        ``camera`` is the model of the upright image, ``horizon`` its prior tilt relative to the
        road, and ``mask`` the weight of each pixel, (H, W), 0 to 1. ``speed_filter`` holds the
        prior speed, ``pitch`` the pitch of the camera if it is known better than by the horizon.
        """
        self._horizon = horizon
        self._view = RoadView(camera, horizon, mask=mask)
        self.pitch = CameraPitch(horizon) if pitch is None else pitch
        """Pitch of the camera relative to the road."""
        self.speed_filter = SpeedFilter() if speed_filter is None else speed_filter
        """Speed of the vehicle."""
        self._azimuth = self._mean_pitch_rate = 0.0
        self._roll = horizon.roll
        # The newest measured distance.
        self._measured = Travel(0.0, 0.0, TravelState.UNKNOWN)
        self._key = RoadKeyframe()
        self._profile = SpeedProfile()
        self._standstill = Standstill(self.speed_filter)

    @property
    def needs_every_frame(self) -> bool:
        """Return whether the road may be in view, but the speed is in doubt."""
        return not self._view.is_empty and self.speed_filter.doubtful

    @property
    def _lacks_pitch(self) -> bool:
        """Return whether the pitch is not known well enough to compare the road."""
        return self.pitch.deviation > TUNING.max_pitch_deviation

    def use_mask(self, mask: NDArray[np.float32] | None) -> None:
        """Continue with this mask; no pair is lost."""
        self._view.use_mask(mask)

    def forget(self) -> None:
        """Restart with the next frame; the pitch of the mounting is kept."""
        self.speed_filter.forget()
        self.pitch.forget_suspension()
        self._profile = SpeedProfile()
        self._mean_pitch_rate = 0.0
        self._standstill = Standstill(self.speed_filter)
        self._view.key_frame = None
        self._key = RoadKeyframe()

    def start(self, frame: Frame, roll: float | None = None) -> None:
        """Add a frame that is the first of a pair, with this ``roll`` (see ``update``)."""
        if roll is not None:
            self._roll = roll
        self._view.restart(frame, self._roll)
        self._key = RoadKeyframe()

    def update(
        self, frame: Frame, interval: float, motion: CameraMotion | None, *,
        yaw: float | None = None, azimuth: float = 0.0, roll: float | None = None,
        still: bool = False, interval_deviation: float = 0.0,
    ) -> Travel:
        """
        Add the next frame, (H, W), and return the distance of its pair in camera heights.

        The frame must not change afterwards. ``interval`` is the time since the previous one, in
        seconds, above 0, with the standard deviation ``interval_deviation``. ``motion`` is that of
        the camera, None if the blocks do not agree; then the ``yaw`` in radians is used, if known.
        A vehicle that drives straight ahead travels at this ``azimuth`` of the camera, in radians,
        positive to the right. ``roll`` is the current roll of the camera relative to the road, in
        radians, positive right side down; None if it is that of the horizon. ``still`` is whether
        nothing but traffic moves in the picture: the vehicle stands, unless the road slides, or it
        cannot have stopped yet.
        """
        self._azimuth = azimuth
        self._roll = self._horizon.roll if roll is None else roll
        self.speed_filter.predict(interval, interval_deviation=interval_deviation)
        self.pitch.predict(interval)
        self._profile.predict(interval)
        if motion is not None:
            yaw = motion.yaw
        self._standstill.see(frame, interval, yaw or 0.0)
        turns = yaw is not None and abs(yaw) > TUNING.driving_yaw_rate * interval
        # What turns while nothing moves is traffic.
        stands = still and (yaw is None or turns or self.speed_filter.least == 0.0)
        if yaw is None or (stands and turns):
            # A pair that shows no pitch rate: what it was before fades.
            self._average(0.0, interval)
            self.start(frame)
            return (self._standstill.halt(interval, self._measured) if stands
                    else self.speed_filter.bridge(interval, self._measured))
        nod = 0.0 if motion is None else self._nod(motion, interval)
        if motion is not None:
            self._learn_pitch(motion, nod, interval)
        turn = (yaw, nod - yaw * math.tan(self._roll), 0.0 if motion is None else motion.roll)
        self._key.add_rotation(
            *turn, nod=nod, interval=interval, near=None if motion is None else motion.near,
            agreement=0.0 if motion is None or turns else motion.agreement)
        travel = self._measure(
            frame, interval, turn, nod=nod, still=still,
            passes=(motion is not None and motion.certain and motion.near >= 0.0
                    and motion.passing > TUNING.driving),
            turns=motion is not None and turns)
        slides = travel.state is TravelState.MEASURED and (
            abs(self.speed_filter.speed) * TUNING.standing_time > TUNING.fixed_cells * CELL)
        if stands and not slides and travel.state is not TravelState.STANDING:
            self.start(frame)
            return self._standstill.halt(interval, self._measured)
        return travel

    def _learn_pitch(self, motion: CameraMotion, nod: float, interval: float) -> None:
        """Learn the pitch from the nod of a pair, and from its direction of travel in a drive."""
        self.pitch.nod(nod, TUNING.block_pitch_deviation)
        speeds, travel = self.speed_filter, motion.travel
        driven = speeds.speed * max(motion.age, interval) * (-1.0 if motion.near < 0.0 else 1.0)
        # At rest, the blocks do not show the direction of travel: it equals its prior.
        moves = max(motion.passing, abs(motion.near)) > TUNING.passing
        # Without the pitch, no road is compared that would correct the speed.
        lacks_pitch = self._lacks_pitch and not speeds.standing
        if moves and (
                lacks_pitch or not speeds.known or speeds.doubtful or driven > TUNING.min_slide):
            self.pitch.add(
                self._horizon.pitch_along(travel.course, travel.slope, azimuth=self._azimuth,
                                          lean=self._view.lean(self._roll)),
                travel.slope_variance)

    def _measure(
        self, frame: Frame, interval: float, turn: tuple[float, float, float], *, nod: float,
        still: bool, passes: bool, turns: bool,
    ) -> Travel:
        """Compare the road with that of the keyframe, or bridge the pair."""
        key, view = self._key, self._view
        if self._lacks_pitch and key.moves:
            view.discard()
        else:
            view.follow(self.pitch.mounting, self._azimuth, may_change=key.age <= interval)
        if not view.patches or view.key_frame is None:
            self.start(frame)
            return self.speed_filter.bridge(interval, self._measured, turns=turns)
        for patch in view.patches:
            patch.add(frame)
        rest = self._rest(frame, interval, still=still, passes=passes, turns=turns)
        if rest is not None:
            return rest
        speeds = self.speed_filter
        found, rivals = self._compare(interval, expected=(
            key.distance + speeds.speed * interval if key.drives and not speeds.lost else 0.0))
        if not any(found) and any(patch.is_offset for patch in view.patches):
            # The speed may be wrong.
            again = self._compare(interval)
            found, rivals = again if any(again[0]) else (found, rivals)
        if any(rivals) or not any(found):
            self._add_to_profile(interval, turn, nod)
        if not any(found):
            found = self._search_further(interval)
        slides = list(filter(None, found))
        travel = self._combine_slides(slides, interval)
        if travel is None or key.expired:
            self._renew(frame)
        # The copies of an encoder have no common speed over half a second.
        rivalled = (key.passes and all(rivals)
                    and not self._profile.confirms(speeds.speed))
        travel = travel or speeds.bridge(interval, self._measured, turns=turns)
        refuted = max((each.refuted for each in slides), default=0.0)
        return replace(travel, rivalled=rivalled, refuted=refuted)

    def _compare(
        self, interval: float, *, expected: float = 0.0,
    ) -> tuple[list[RoadSlide | None], list[bool]]:
        """Return the slide of each patch since the keyframe, and whether it has a rival."""
        turn = rotation(self._key.yaw, self._key.pitch, self._key.roll)
        for patch in self._view.patches:
            patch.compare(turn, expected)
        found = self._slides(interval, self.speed_filter)
        return found, [patch.is_rivalled(each) for patch, each in zip(self._view.patches, found)]

    def _rest(
        self, frame: Frame, interval: float, *, still: bool, passes: bool, turns: bool,
    ) -> Travel | None:
        """Return the distance of a pair if the road rests; None if it must be measured."""
        # The first patch is the near one, if that is in view: traffic mostly covers the far one.
        near, key, standstill = self._view.patches[0], self._key, self._standstill
        if not standstill.rests(near, key, still=still, passes=passes):
            return None
        if passes:
            self.start(frame)
            return self.speed_filter.bridge(interval, self._measured, turns=turns)
        if still or standstill.lasts or key.age >= TUNING.standing_time:
            return self._stand(frame, interval)
        return self._bridge_keyframe(interval) if key.moves else None

    def _stand(self, frame: Frame, interval: float) -> Travel:
        """Return the distance of a pair in which the road rests, whatever the blocks show."""
        key = self._key
        # The camera has not turned since the keyframe: what turns is traffic.
        self.pitch.nod(-key.nod, 0.0)
        self._mean_pitch_rate = 0.0
        self._standstill.lasts = True
        self._key = RoadKeyframe(key.age, agreed=True)
        if key.age >= TUNING.creep_time:
            self._renew(frame)
        return self._standstill.halt(interval, self._measured, rests=True)

    def _search_further(self, interval: float) -> list[RoadSlide | None]:
        """Return slides beyond the bounds of the speed, or that of the profile."""
        speeds = self.speed_filter
        if speeds.standing and self._key.min_slide > 0.0:
            # All patches agree on a slide that no vehicle reaches from standing: the picture was
            # frozen. (When driving, an encoder or the pattern of the markings may cause the same.)
            found = self._slides(interval, SpeedFilter())
            anywhere = list(filter(None, found))
            if 1 < len(anywhere) == len(found) == len(self._agreeing(anywhere, anywhere[0])):
                speeds.forget()
                self._key.age = interval
                return found
        return [self._slide_by_profile(interval)]

    def _add_to_profile(
        self, interval: float, turn: tuple[float, float, float], nod: float,
    ) -> None:
        """Add the changes in the newest frames to the profile of the speed."""
        ways, turned = self._profile.speeds * interval, rotation(*turn)
        scores = np.array([
            patch.scores_of_changes(ways, turned, tilt=self._tilt(nod),
                                    roll=self._view.lean(self._roll - turn[2]))
            for patch in self._view.patches]).sum(axis=0)
        # Patterns that change their place a little make slides near 0.
        self._profile.add(scores, np.isfinite(scores) & (ways > TUNING.profile_begins))

    def _slide_by_profile(self, interval: float) -> RoadSlide | None:
        """Return the slide at the speed of the profile; None if it has none."""
        key = self._key
        # It has no speeds in reverse.
        best = self._profile.best if key.moves and key.passing >= 0.0 else None
        if best is None or (interval > TUNING.profile_alone_s and not key.agreed):
            return None
        (speed, score), speeds, near = best, self.speed_filter, self._view.patches[0]
        refuted = speeds.refuted_by(speed, self._profile.time)
        least, most = speeds.bounds(TUNING.profile_width * speed)
        if speeds.lost or not least <= speed <= most:
            # When the vehicle brakes, the mean of earlier pairs is too high.
            if speeds.known and not speeds.doubtful:
                return None
            speeds.forget()
            key.age = interval
        distance = key.distance + speed * interval
        deviation = math.hypot(near.deviation(key), TUNING.acceleration * interval ** 2)
        return RoadSlide(
            distance, deviation, score, near.depth, near.depth, distance, False, refuted=refuted)

    def _slides(self, interval: float, speeds: SpeedFilter) -> list[RoadSlide | None]:
        """Return the slide of each patch within the bounds of ``speeds``."""
        found = []
        for patch in self._view.patches:
            least, most = (
                self._key.distance + speed * interval
                for speed in speeds.bounds(
                    patch.deviation(self._key) / interval, reverses=self._key.recedes))
            found.append(patch.find(
                least, most, self._key, tilt=self._tilt(self._key.nod)))
        return found

    def _renew(self, frame: Frame) -> None:
        """Make the newest frame the keyframe."""
        moved_on = self._key.drives or self._key.distance > TUNING.learning_slide
        self._view.renew(frame, self._roll, learns=moved_on)
        self._key = RoadKeyframe()

    def _nod(self, motion: CameraMotion, interval: float) -> float:
        """Return the change of the pitch relative to the road in a pair, positive nose up."""
        # The suspension oscillates. A lasting pitch rate comes from a vertical curve of the road,
        # which the vehicle follows, or from an error of the blocks.
        nod = motion.nod(self._roll)
        self._average(nod, interval)
        return nod - self._mean_pitch_rate * interval

    def _average(self, nod: float, interval: float) -> None:
        """Add the nod of a pair to the mean pitch rate."""
        self._mean_pitch_rate = running_mean(
            self._mean_pitch_rate, nod / interval, interval, time=TUNING.grade_time)

    def _combine_slides(self, found: list[RoadSlide], interval: float) -> Travel | None:
        """Combine the slides of the patches."""
        key = self._key
        found = [
            each for each in found if not each.sudden and not (each.fixed and key.moves)
        ] or found
        if not found:
            return None
        best = max(found, key=lambda each: each.score)
        agreeing = self._agreeing(found, best)
        if len(agreeing) == 2 and (
                math.copysign(1.0, key.passing) * best.distance > TUNING.min_slide):
            self._learn_pitch_from(*agreeing)
            agreeing = [
                replace(each, distance=each.raw / slide_scale(each.depth, self._tilt(key.nod)))
                for each in agreeing]
        if all(each.fixed for each in agreeing) and (
                key.moves or self.speed_filter.standing or key.age >= TUNING.standing_time):
            return self._without_slide(interval)
        # However wrong the stamps are, a vehicle does not stop between two frames.
        halts = best.fixed and (
            self._standstill.covered
            or self.speed_filter.least * interval > TUNING.fixed_cells * CELL)
        if best.sudden or halts:
            return self._bridge_keyframe(interval)
        self._standstill.covered = False
        return self._travel(agreeing, interval)

    def _without_slide(self, interval: float) -> Travel:
        """Return the distance of a pair whose road has not moved since the keyframe."""
        key = self._key
        if key.moves:
            # A slow vehicle, or a pattern that is fixed to the camera: wait for a later frame.
            key.expired = key.age >= TUNING.max_keyframe_age
            return self._bridge_keyframe(interval)
        key.expired = key.age >= TUNING.creep_time
        if key.turns:
            # A vehicle that turns on the spot, or a pattern that is fixed to it, which a later
            # frame tells apart.
            return self.speed_filter.bridge(interval, self._measured, turns=True)
        near = self._view.patches[0]
        rests = key.agreement > TUNING.resting_agreement and near.has_moved
        if self.speed_filter.least > 0.0 and not (rests or near.rests()):
            # The edges of a straight road look the same at any speed.
            return self._bridge_keyframe(interval)
        return self._standstill.halt(interval, self._measured, rests=rests)

    def _travel(self, agreeing: list[RoadSlide], interval: float) -> Travel:
        """Return the distance of the newest pair, from the slides since the keyframe."""
        weights = np.array([each.deviation ** -2 for each in agreeing])
        distance = float(weights @ [each.distance for each in agreeing] / weights.sum())
        # Both errors come from the same pitch motion, so the mean is hardly better.
        own = min(each.deviation for each in agreeing) ** 2
        depth, key = agreeing[0].depth, self._key
        # The first speed is the mean one since the keyframe.
        time = interval if self.speed_filter.known else key.age
        speed = (distance - key.distance) / time
        speed_variance = (own + key.variance) / (time * time)
        swing = 2.0 * depth * self.pitch.swing_deviation
        tilt = 2.0 * depth * self.pitch.common_deviation
        key.expired = key.is_far(distance, interval)
        newest, variance = key.add(distance, own, self.speed_filter, interval)
        self.speed_filter.add(speed, speed_variance, clear=(
            len(agreeing) == len(self._view.patches)
            and max(each.score for each in agreeing) > TUNING.clear_score))
        self._measured = Travel(
            newest, variance + (swing ** 2 + tilt ** 2) * newest ** 2, TravelState.MEASURED,
            swing, tilt)
        return self._measured

    def _agreeing(self, found: list[RoadSlide], best: RoadSlide) -> list[RoadSlide]:
        """Return the slides that differ from the best one by no more than their errors."""
        return [
            each for each in found
            if abs(each.distance - best.distance) <= TUNING.slide_gate * math.hypot(
                each.deviation, best.deviation,
                2.0 * (each.depth - best.depth) * self.pitch.deviation * best.distance)]

    def _learn_pitch_from(self, near: RoadSlide, far: RoadSlide) -> None:
        """Estimate the pitch from the slides of the near and the far patch."""
        if near.raw * far.raw <= 0.0:
            return
        # A change of the pitch moves the far road more than the near road, in the same direction.
        nod = (far.newest_depth ** 2 - near.newest_depth ** 2) * TUNING.block_pitch_deviation
        moved = any(each.depth > each.newest_depth for each in (near, far))
        self.pitch.add_slides(
            far.raw / near.raw, far.depth - near.depth,
            (nod ** 2 + 2.0 * (TUNING.peak_cells * CELL) ** 2) / near.raw ** 2
            + (TUNING.offset_error if moved else 0.0) ** 2,
            assumed=self._view.pitch - self._key.nod)

    def _tilt(self, nod: float) -> float:
        """
        Return the pitch relative to that for which the patches are made, before the ``nod``.

        The newest frame is rotated to the one before the nod, so the slides have that pitch.
        """
        return self.pitch.current + nod - self._view.pitch

    def _bridge_keyframe(self, interval: float) -> Travel:
        """Bridge a pair whose distance is measured with a later frame."""
        travel = self.speed_filter.bridge(interval, self._measured)
        if travel.state is TravelState.BRIDGED:
            self._key.bridge(
                travel.distance, (self.speed_filter.observed_deviation * interval) ** 2)
        return travel
