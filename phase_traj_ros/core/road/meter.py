# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measures the distance travelled in camera heights, from the displacement of the road surface.

A near and a far patch of the road are projected to a bird's-eye view. The rotation of the camera,
known from the blocks of the heading, is removed. The remaining motion of a patch is a translation
towards the vehicle.

Each frame is compared with a keyframe. It is the previous frame if the road has slid far enough
since; at a walking pace or a high frame rate it is up to half a second old.
"""

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.heading.camera_motion import CameraMotion
from phase_traj_ros.core.road.fixed_pattern import FixedPattern
from phase_traj_ros.core.road.ground import CELL, GroundPatch, rotation, stretches
from phase_traj_ros.core.road.slide import Slide
from phase_traj_ros.core.road.speed_filter import SpeedFilter
from phase_traj_ros.core.road.tilt import RoadTilt
from phase_traj_ros.core.road.travel import Travel, TravelState

# Significance that a peak needs, in standard deviations: among a thousand positions, noise does
# not reach it.
_STANDS_OUT = 7.0
# Standard deviations of the position of a peak, in cells, and of the pitch from the blocks between
# two frames, in radians.
_PEAK, _NODDING = 0.3, 0.0006
# Standard deviation of the pitch if the blocks do not measure it: the motion of the suspension.
_SPRINGS = 0.0025
# Largest deviation of the pitch, in radians, with which the distance is measured, and largest
# error of the pitch before the patches are made again.
_SURE, _REMADE = 0.03, 0.006
# The road has moved on, for the pattern that does not, if it has slid by this, in camera heights.
_LEARNS = 0.2
# Two slides disagree if they differ by this many standard deviations.
_DIFFER = 4.0
# Minimum visible share of a patch.
_LEAST_SEEN = 0.3
# A pattern that slides by less than _FIXED_CELLS may be fixed to the camera, or the vehicle
# stands. The vehicle moves if the median ratio of translation to distance exceeds _PASSING. Above
# _DRIVEN, the road has slid by more than that.
_FIXED_CELLS, _PASSING, _DRIVEN = 1.0, 0.002, 0.01
# Least median distance of what the blocks show, in camera heights.
_NEAREST = 2.0
# A keyframe is replaced before the road slides by _BASELINE camera heights, when the camera has
# turned by _TURNED radians, or after _LONGEST seconds. The vehicle stands if the road has not slid
# for _STANDS seconds; from then on, the keyframe is kept for _CREEPS seconds.
_BASELINE, _TURNED, _LONGEST, _STANDS, _CREEPS = 0.75, 0.06, 0.5, 0.3, 2.0
# A standing vehicle turns at less than this, in radians per second.
_TURNING = math.radians(3.0)
# Time constant, in seconds, after which a continuing pitch is attributed to the road.
_BENDS = 2.0
# Longest time, in seconds, for which the last speed bridges a gap.
_HOLDS = 2.5
# Minimum slide of a pair, in camera heights, for the estimation of the pitch.
_LEAST_SLIDE = 0.1


@dataclass(frozen=True, slots=True)
class _Found:
    """Slide of a patch in camera heights, with its deviation and its position."""

    way: float
    deviation: float
    score: float
    middle: float
    raw: float
    fixed: bool
    """Whether it may be that of a pattern that is fixed to the camera."""


@dataclass(frozen=True, slots=True)
class _Look:
    """A patch, its comparison with the previous one, and what never moves in it."""

    patch: GroundPatch
    slide: Slide
    fixed: FixedPattern

    def rivals(self, found: _Found | None) -> bool:
        """Return whether another slide stands out, and more than the one that was found."""
        if found is None:
            return self.slide.rival(None) > _STANDS_OUT
        return self.slide.rival(found.raw / CELL) > max(_STANDS_OUT, found.score)


@dataclass(frozen=True, slots=True)
class _Turned:
    """Rotation of the camera, the deviation of its pitch, and the motion past the blocks."""

    yaw: float
    pitch: float
    roll: float
    nodding: float
    age: float
    """Seconds in which it turned."""
    passing: float | None
    """Median ratio of translation to distance of the blocks; None if they do not agree."""

    @property
    def moves(self) -> bool:
        """Return whether the vehicle moves, independent of the patches."""
        return self.passing is None or self.passing > _PASSING

    @property
    def drives(self) -> bool:
        """Return whether the road must have slid, so that what has not is not the road."""
        return self.passing is None or self.passing > _DRIVEN

    @property
    def least(self) -> float:
        """Return the least slide of the road in camera heights, by what the blocks show."""
        return _NEAREST * (self.passing or 0.0) if self.drives else 0.0

    @property
    def swings(self) -> bool:
        """Return whether the vehicle turns as only one that drives can."""
        return abs(self.yaw) > _TURNING * self.age


@dataclass(slots=True)
class _Since:
    """Time, rotation and distance since the keyframe, in seconds, radians and camera heights."""

    age: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    given: float = 0.0
    """Sum of the distances of the pairs since."""
    variance: float = 0.0
    before: float = 0.0
    """The same without the newest pair, and its variance."""
    before_variance: float = 0.0
    over: bool = False
    """Whether the newest frame becomes the keyframe."""

    def turn(self, yaw: float, pitch: float, roll: float, interval: float) -> None:
        """Add the rotation of a pair."""
        self.yaw += yaw
        self.pitch += pitch
        self.roll += roll
        self.age += interval

    def add(
        self, way: float, variance: float, speed_filter: SpeedFilter, interval: float,
    ) -> tuple[float, float]:
        """
        Return the distance of the newest pair and its variance, from that since the keyframe.

        Up to the last pair before a new keyframe, it is smoothed with the speed. The sum of all
        is the distance between the keyframes.
        """
        self.before, self.before_variance = self.given, self.variance
        if self.over or not speed_filter.known:
            self.given, self.variance = way, variance
            return self.given - self.before, variance
        foreseen = self.before + speed_filter.speed * interval
        off = self.before_variance + (speed_filter.deviation * interval) ** 2
        gain = off / (off + variance)
        self.given, self.variance = foreseen + gain * (way - foreseen), gain * variance
        return self.given - self.before, (speed_filter.deviation * interval) ** 2


class RoadMeter:
    """Measures the distance that a camera travels between frames."""

    def __init__(
        self, camera: CameraModel, horizon: Horizon, *, pitch_known: bool = False,
        rotate_180: bool = False, mask: NDArray[np.float32] | None = None,
        speed_filter: SpeedFilter | None = None, keyframes: bool = True,
    ) -> None:
        """
        Make a meter that waits for its first frame.

        Parameters
        ----------
        camera
            Camera model of the upright image.
        horizon
            Prior tilt of the camera relative to the road.
        pitch_known
            Whether the pitch of ``horizon`` is exact.
        rotate_180
            Whether the frames are upside down.
        mask
            Weight of each pixel of the frames, (H, W), 0 to 1.
        speed_filter
            Prior speed; None if it is unknown.
        keyframes
            Whether a frame may be compared with an earlier one than its predecessor.

        """
        self._keyframes = keyframes
        self._camera, self._horizon = camera, horizon
        self._rotate_180, self._mask = rotate_180, mask
        self._tilt = RoadTilt(horizon, fixed=pitch_known)
        self.speed_filter = SpeedFilter() if speed_filter is None else speed_filter
        """Speed of the vehicle."""
        self._looks: tuple[_Look, ...] | None = None
        self._assumed, self._bending = 0.0, 0.0
        self._kept: Frame | None = None
        # Shares of the errors of the pitch in the newest measured distance.
        self._shares = 0.0, 0.0
        self._rivalled = False
        self._since = _Since()

    @property
    def tilt(self) -> RoadTilt:
        """Return the pitch of the camera relative to the road."""
        return self._tilt

    def use_mask(self, mask: NDArray[np.float32] | None) -> None:
        """Continue with another mask; no pair is lost."""
        self._mask, self._looks = mask, None

    def forget(self) -> None:
        """Restart with the next frame; the tilt is kept."""
        self.speed_filter.forget()
        self._bending = 0.0
        self._kept, self._since = None, _Since()

    def start(self, frame: Frame) -> None:
        """Add a frame that is the first of a pair."""
        self._kept = frame
        self._since = _Since()
        if self._looks is not None:
            self._keep([look.patch(frame) for look in self._looks])

    def update(
        self, frame: Frame, interval: float, motion: CameraMotion | None, *,
        yaw: float | None = None, still: bool = False, unsure: float = 0.0,
    ) -> Travel:
        """
        Add the next frame, and return the distance of its pair in camera heights.

        Parameters
        ----------
        frame
            (H, W); it must not change afterwards.
        interval
            Seconds since the previous frame, above 0.
        motion
            Rotation of the camera since then; None if the blocks do not agree, such as in
            reverse.
        yaw
            Yaw in radians, used if ``motion`` is None; None if it is unknown.
        still
            Whether the vehicle is known to stand.
        unsure
            Standard deviation of the interval.

        """
        self.speed_filter.pass_time(interval, unsure=unsure)
        self._tilt.pass_time(interval)
        travel, self._rivalled = None, False
        if still:
            self.start(frame)
            travel = self._standing(interval)
        elif motion is not None:
            driven = self.speed_filter.speed * max(motion.age, interval)
            if not self.speed_filter.known or driven > _LEAST_SLIDE:
                self._tilt.add_travel(motion.travel.slope, motion.travel.slope_variance)
            self._since.turn(
                motion.yaw, self._nodded(motion.pitch, interval), motion.roll, interval)
            # The blocks have another keyframe.
            share = min(self._since.age / motion.age, 1.0) if motion.age > 0.0 else 1.0
            travel = self._measure(frame, interval, _NODDING, share * motion.passing)
        elif yaw is not None:
            self._since.turn(yaw, 0.0, 0.0, interval)
            travel = self._measure(frame, interval, _SPRINGS, None)
        else:
            self.start(frame)
        turns = motion is not None and abs(motion.yaw) > _TURNING * interval
        travel = travel or self._bridged(interval, turns=turns and not still)
        return replace(travel, rivalled=self._rivalled)

    def _measure(
        self, frame: Frame, interval: float, nodding: float, passing: float | None,
    ) -> Travel | None:
        if self._tilt.deviation > _SURE:
            self._looks = None
            self.start(frame)
            return None
        if self._looks is None or (
                self._since.age <= interval
                and abs(self._tilt.mounting - self._assumed) > _REMADE):
            self._look_anew(self._kept)
        assert self._looks is not None
        if self._kept is None:
            self.start(frame)
            return None
        since = self._since
        turned = _Turned(since.yaw, since.pitch, since.roll, nodding, since.age, passing)
        turn = rotation(turned.yaw, turned.pitch, turned.roll)
        patches = [look.patch(frame) for look in self._looks]
        for look, patch in zip(self._looks, patches):
            look.slide.compare(look.patch.turned_back(look.fixed.removed(patch), turn))
        found = self._slides(interval, turned, self.speed_filter)
        if found == [None] * len(found) and turned.least > 0.0:
            # The road slides as it cannot at this speed, and all patches agree: the picture was
            # frozen before, or the speed is wrong.
            anywhere = self._slides(interval, turned, SpeedFilter())
            sure = [each for each in anywhere if each is not None]
            if len(sure) > 1 and len(self._agreeing(sure, sure[0])) == len(self._looks):
                self.speed_filter.forget()
                found = anywhere
        self._rivalled = passing is not None and turned.drives and all(
            look.rivals(each) for look, each in zip(self._looks, found))
        travel = self._judged([each for each in found if each is not None], interval, turned)
        if travel is None or since.over:
            if turned.drives or since.given > _LEARNS:
                for look, patch in zip(self._looks, patches):
                    look.fixed.learn(patch)
            self._kept, self._since = frame, _Since()
            self._keep(patches)
        return travel

    def _nodded(self, pitch: float, interval: float) -> float:
        """
        Return the change of the pitch of the camera relative to the road.

        The suspension oscillates. A pitch that continues for longer comes from a vertical curve of
        the road, which the vehicle follows, or from an error of the blocks.
        """
        share = 1.0 - math.exp(-interval / _BENDS)
        self._bending += share * (pitch / interval - self._bending)
        return pitch - self._bending * interval

    def _judged(
        self, found: list[_Found], interval: float, turned: _Turned,
    ) -> Travel | None:
        """Combine the slides of the patches."""
        if turned.moves:
            found = [each for each in found if not each.fixed] or found
        if not found:
            return None
        best = max(found, key=lambda each: each.score)
        agreeing = self._agreeing(found, best)
        if len(agreeing) == 2 and best.way > _LEAST_SLIDE:
            self._compare(*agreeing)
            agreeing = [replace(
                each, way=each.raw / self._stretched(each.middle)) for each in agreeing]
        since = self._since
        stood = self.speed_filter.known and self.speed_filter.speed == 0.0
        if all(each.fixed for each in agreeing):
            if turned.moves:
                # A slow vehicle, or a pattern that is fixed to the camera: a later frame tells.
                since.over = since.age >= _LONGEST
                return self._waiting(interval)
            if stood or since.age >= _STANDS:
                since.over = since.age >= _CREEPS
                # A vehicle does not turn on the spot: the patch does not show the road.
                return None if turned.swings else self._standing(interval)
        weights = np.array([each.deviation ** -2 for each in agreeing])
        way = float(weights @ [each.way for each in agreeing] / weights.sum())
        # Both errors come from the same pitch motion, so the mean is hardly better.
        own = min(each.deviation for each in agreeing) ** 2
        depth = agreeing[0].middle
        swing = 2.0 * depth * self._tilt.swing_deviation
        tilt = 2.0 * depth * self._tilt.common_deviation
        self._shares = swing, tilt
        further = 1.0 + interval / since.age
        since.over = (not self._keyframes or further * abs(way) > _BASELINE
                      or since.age >= _LONGEST or abs(since.yaw) > _TURNED)
        distance, variance = since.add(way, own, self.speed_filter, interval)
        # The first speed is the mean one since the keyframe.
        time = interval if self.speed_filter.known else since.age
        self.speed_filter.add(
            (way - since.before) / time,
            (own + since.before_variance) / (time * time))
        return Travel(
            distance, variance + (swing ** 2 + tilt ** 2) * distance ** 2, TravelState.MEASURED,
            swing, tilt)

    def _agreeing(self, found: list[_Found], best: _Found) -> list[_Found]:
        """Return the slides that differ from the best one by no more than their errors."""
        return [
            each for each in found if abs(each.way - best.way) <= _DIFFER * math.hypot(
                each.deviation, best.deviation,
                2.0 * (each.middle - best.middle) * self._tilt.deviation * best.way)]

    def _compare(self, near: _Found, far: _Found) -> None:
        if near.raw <= 0.0 or far.raw <= 0.0:
            return
        # A change of the pitch moves the far road more than the near road, in the same direction.
        nod = (far.middle ** 2 - near.middle ** 2) * _NODDING
        self._tilt.add_slides(
            far.raw / near.raw, far.middle - near.middle,
            (nod ** 2 + 2.0 * (_PEAK * CELL) ** 2) / near.raw ** 2, assumed=self._assumed)

    def _slides(
        self, interval: float, turned: _Turned, speeds: SpeedFilter,
    ) -> list[_Found | None]:
        """Return the slide of each patch, None where none stands out."""
        return [self._slid(look, interval, turned, speeds) for look in self._looks or ()]

    def _slid(
        self, look: _Look, interval: float, turned: _Turned, speeds: SpeedFilter,
    ) -> _Found | None:
        middle = look.patch.middle
        stretched = self._stretched(middle)
        deviation = math.hypot(_PEAK * CELL, (1.0 + middle * middle) * turned.nodding)
        given = self._since.given
        least, most = (
            (given + speed * interval) * stretched / CELL
            for speed in speeds.bounds(deviation / interval))
        most = min(most, look.slide.most)
        if not turned.moves:
            least = min(least, -_FIXED_CELLS)
        # Where the rotation takes a pattern that is fixed to the camera, and around it.
        pattern = -(1.0 + middle * middle) * turned.pitch / CELL
        below, above = min(pattern, 0.0) - _FIXED_CELLS, max(pattern, 0.0) + _FIXED_CELLS
        # What slides is the road, even if such a pattern is stronger.
        slowest = turned.least / CELL if turned.drives else above
        places = [(max(least, above, slowest), most), (least, min(most, below))]
        if turned.drives and turned.passing is not None and most > 0.0:
            del places[1]
        peaks = [look.slide.peak(*place) for place in places] if turned.moves else []
        peak = max(filter(None, peaks), key=lambda each: each.score, default=None)
        if not turned.drives and (peak is None or peak.score < _STANDS_OUT):
            peak = look.slide.peak(least, most)
        if peak is None or peak.score < _STANDS_OUT:
            return None
        raw = peak.cells * CELL
        return _Found(
            raw / stretched, deviation, peak.score, middle, raw, below < peak.cells < above)

    def _stretched(self, middle: float) -> float:
        """Return the factor by which a slide is too large, as the pitch has changed."""
        return math.exp(2.0 * middle * (self._tilt.pitch - self._assumed))

    def _waiting(self, interval: float) -> Travel:
        """Bridge a pair whose way the keyframe will tell later."""
        travel, since = self._bridged(interval, turns=False), self._since
        if travel.state is TravelState.BRIDGED:
            since.given += travel.distance
            since.variance += (self.speed_filter.deviation * interval) ** 2
        return travel

    def _standing(self, interval: float) -> Travel:
        self.speed_filter.stand()
        # A slower slide than this would not be seen while a keyframe is kept.
        return Travel(
            0.0, (_PEAK * CELL * interval / _CREEPS) ** 2, TravelState.STANDING)

    def _bridged(self, interval: float, *, turns: bool) -> Travel:
        off = self.speed_filter.deviation * interval
        # A turning vehicle moves, even if it was standing when it was last measured.
        if not self.speed_filter.known or (turns and self.speed_filter.speed == 0.0):
            return Travel(1.0, off ** 2, TravelState.UNKNOWN)
        way = self.speed_filter.speed * min(interval, _HOLDS)
        if self.speed_filter.lost:
            # The drawn path continues with the last speed, but this is not a distance.
            return Travel(way, off ** 2, TravelState.UNKNOWN)
        # The error of the speed is correlated between pairs, and it has those of the pitch.
        swing, tilt = self._shares
        variance = off ** 2 + (swing ** 2 + tilt ** 2) * way ** 2
        if abs(way) > CELL:
            swing = math.hypot(swing, off / way)
        return Travel(way, variance, TravelState.BRIDGED, swing, tilt)

    def _look_anew(self, before: Frame | None) -> None:
        """Make the patches with the current tilt."""
        self._assumed = self._tilt.mounting
        horizon = replace(self._horizon, pitch=self._assumed)
        patches = [
            GroundPatch(self._camera, horizon, stretch, rotate_180=self._rotate_180,
                        mask=self._mask)
            for stretch in stretches(self._camera, horizon)]
        self._looks = tuple(
            _Look(patch, Slide(patch.window), FixedPattern())
            for patch in patches if patch.share > _LEAST_SEEN)
        if before is not None:
            self._keep([look.patch(before) for look in self._looks])

    def _keep(self, patches: list[NDArray[np.float32]]) -> None:
        for look, patch in zip(self._looks or (), patches):
            look.slide.keep(look.fixed.removed(patch))
