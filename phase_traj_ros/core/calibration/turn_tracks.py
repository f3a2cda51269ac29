# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tracks points of the image through a turn.

A step ends when the image has moved by a twentieth of its width, and at the latest before near
points leave the image. A stretch is a part of a turn of about ten steps. If the image turns
slowly, points are tracked more often than once a step, as near points still move fast. While the
image does not turn, nothing is tracked.
"""

from dataclasses import dataclass, replace
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.camera.lens_family import Numbers
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.correlation.view import reduced

Bytes = NDArray[np.uint8]
Places = NDArray[np.float32]

_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, TUNING.search_steps, TUNING.search_px)


@dataclass(frozen=True, slots=True, eq=False)
class TurnTracks:
    """
    Points tracked over the K frames of a part of a turn: M observations of P points.

    point
        (M,) number of the point, 0 to P - 1, increasing; each has three observations or more.
    frame
        (M,) number of the frame, 0 to K - 1, increasing for each point.
    position
        (M, 2) column and row in pixels from the image centre.
    flow
        (K,) motion of the image to the right since the first frame, in pixels.
    seconds
        (K,) time since the first frame.
    reduction
        Number of pixels along a side that were averaged into one for the tracking.
    """

    point: NDArray[np.int64]
    frame: NDArray[np.int64]
    position: Numbers
    flow: Numbers
    seconds: Numbers
    reduction: int = 1

    def of(self, points: NDArray[np.bool_]) -> 'TurnTracks':
        """Return the observations of some of the points, (P,)."""
        kept = points[self.point]
        numbers = np.cumsum(points) - 1
        return replace(
            self, point=numbers[self.point[kept]], frame=self.frame[kept],
            position=self.position[kept])

    def backwards(self) -> 'TurnTracks':
        """Return the observations backwards in time: those of a vehicle that does not reverse."""
        frame = len(self.flow) - 1 - self.frame
        order = np.lexsort((frame, self.point))
        return replace(
            self, point=self.point[order], frame=frame[order], position=self.position[order],
            flow=(self.flow - self.flow[-1])[::-1],
            seconds=(self.seconds[-1] - self.seconds)[::-1])


class TurnTracker:
    """Tracks points through turns; it stores one stretch at a time."""

    def __init__(self) -> None:
        """Make a tracker before the first frame."""
        self.mask: NDArray[np.uint8] | None = None
        """Mask (H, W) for stretches that start from now on; pixels with 0 are ignored."""
        self.cut()

    def cut(self) -> None:
        """Forget the stretch in progress and the last frame."""
        self._last: Frame | None = None
        self._stretch: _Stretch | None = None
        # Speed of the image in pixels per second, for how many seconds it has been that of a turn,
        # and the largest one of the stretch in widths per second.
        self._rate = self._lasted = self._fastest = 0.0
        self._reverses = False

    def finish(self) -> TurnTracks | None:
        """Return the stretch in progress if it is usable, and forget it."""
        stretch, self._stretch = self._stretch, None
        tracks = None if stretch is None else stretch.tracks()
        return tracks.backwards() if tracks is not None and self._reverses else tracks

    def update(self, frame: Frame, shift_px: float, interval: float, *,
               reverses: bool | None = None, wanted: bool = True) -> TurnTracks | None:
        """
        Add the next frame; return the stretch that ends with it, if it is usable.

        See ``SelfCalibration.update``. ``wanted`` is whether a stretch may start. A stretch in
        reverse is returned backwards in time.
        """
        last, width = self._last, frame.shape[1]
        if last is None or interval <= 0.0:
            self.cut()
            self._last = frame
            return None
        self._last = frame
        if not abs(shift_px) < TUNING.max_frame_motion * width:
            return self.finish()
        if reverses is not None and reverses != self._reverses:
            finished = self.finish()
            self._reverses = reverses
            return finished
        kept, before = math.exp(-interval / TUNING.turn_speed_time_s), self._rate
        self._rate = kept * before + (1.0 - kept) * shift_px / interval
        rate = abs(self._rate) / width
        self._fastest = rate if self._stretch is None else max(rate, self._fastest)
        # The mean may pass 0 between two frames.
        turns_back = self._stretch is not None and before * self._rate < 0.0
        if turns_back or rate < max(TUNING.min_turn_speed, TUNING.ended_share * self._fastest):
            self._lasted = 0.0
            return self.finish()
        self._lasted += interval
        if self._stretch is None:
            # The noise of the shift may be as fast as a slow turn, but it does not last.
            begins = rate > TUNING.clear_turn_speed or self._lasted > TUNING.slow_turn_s
            if not wanted or not begins:
                return None
            self._stretch = _Stretch(last, self.mask)
        if self._stretch.add(frame, shift_px, interval):
            return None
        return self.finish()


class _Stretch:
    """A part of a turn: the points observed in its steps so far."""

    def __init__(self, first: Frame, mask: NDArray[np.uint8] | None) -> None:
        self._reduction = math.ceil(first.shape[1] / TUNING.tracked_px)
        self._height, self._width = (side // self._reduction for side in first.shape)
        self._apart = max(TUNING.min_distance_px, round(self._width * TUNING.min_distance_share))
        small = self._width < TUNING.small_px
        self._window = TUNING.small_window_px if small else TUNING.window_px
        self._first, self._mask = first, mask
        # Positions of the points now and at the last step, and their numbers.
        self._points = self._recorded = np.zeros((0, 2), np.float32)
        self._ids = np.zeros(0, np.int64)
        self._count = 0
        self._observations: list[Numbers] = []
        # Motion of the image and time at each step, and since the points were last tracked and
        # since the last step.
        self._steps = [np.zeros(2)]
        self._motion, self._step = np.zeros(2), np.zeros(2)

    def add(self, frame: Frame, shift_px: float, interval: float) -> bool:
        """Add the next frame; return whether the stretch continues."""
        self._motion += shift_px / self._reduction, interval
        moved, since = self._motion
        small = abs(moved) < TUNING.step * self._width
        if small and since < TUNING.max_tracking_interval_s:
            return True
        if not self._observations:
            # Delayed until the motion has lasted for a while, unlike most shakes.
            self._picture, self._allowed = self._reduced(self._first), self._open_area()
            self._record()
        turns_back = moved * self._steps[-1][0] < 0.0 and not small
        if turns_back or not self._track(self._reduced(frame), moved):
            return False
        self._step += self._motion
        self._motion[:] = 0.0
        if abs(self._step[0]) < TUNING.step * self._width and (
                self._step[1] < TUNING.min_step_s
                or self._parallax() < TUNING.min_parallax * self._width):
            return True
        self._steps.append(self._steps[-1] + self._step)
        self._step[:] = 0.0
        self._record()
        return (abs(self._steps[-1][0]) < TUNING.stretch * self._width
                and len(self._steps) < TUNING.max_steps)

    def tracks(self) -> TurnTracks | None:
        """Return the points with three observations or more, those with the most of them."""
        flow, seconds = np.array(self._steps).T
        if len(flow) < TUNING.min_steps or abs(flow[-1]) < TUNING.min_stretch * self._width:
            return None
        observations = np.concatenate(self._observations)
        observations = observations[np.lexsort((observations[:, 1], observations[:, 0]))]
        point, frame = observations[:, :2].astype(np.int64).T
        # The reduced image may lack the last pixels of the full one; their centres nearly agree.
        middle = (np.array([self._width, self._height]) - 1.0) / 2.0
        counts = np.bincount(point)
        best = np.argsort(-counts, kind='stable')[:TUNING.kept_points]
        tracks = TurnTracks(
            point, frame, (observations[:, 2:] - middle) * self._reduction,
            flow * self._reduction, seconds, self._reduction,
        ).of((counts >= 3) & np.isin(np.arange(len(counts)), best))
        return tracks if len(np.unique(tracks.point)) >= TUNING.min_points else None

    def _reduced(self, frame: Frame) -> Bytes:
        """Return the frame, uint8, reduced to the width for tracking."""
        return np.asarray(reduced(frame, self._reduction, self._reduction), np.uint8)

    def _open_area(self) -> Bytes:
        """Return a mask that is 255 where points may be, else 0."""
        if self._mask is None or self._mask.shape != self._first.shape:
            return np.full((self._height, self._width), 255, np.uint8)
        seen = cv2.resize(
            (self._mask > 127).astype(np.uint8), (self._width, self._height),
            interpolation=cv2.INTER_NEAREST)
        return np.asarray(cv2.erode(seen, np.ones((TUNING.window_px,) * 2)) * 255, np.uint8)

    def _record(self) -> None:
        """Detect points in areas without any, and record the positions of all points."""
        free = self._allowed.copy()
        for position in np.rint(self._points).astype(int).tolist():
            cv2.circle(free, position, self._apart, 0, -1)
        wanted = TUNING.points - len(self._points)
        # The centre of a corner is searched within twice its radius, and 5 pixels.
        large = min(self._picture.shape) >= 2 * TUNING.centre_px + 5
        if large and wanted > TUNING.points // 10:
            found = cv2.goodFeaturesToTrack(
                self._picture, wanted, TUNING.corner_quality, self._apart, mask=free)
            new: Places = np.zeros((0, 2), np.float32)
            if found is not None:
                # The motion that is measured is that of the centre of the gradients. A point
                # beside it would not move apart from it where the image is stretched.
                centred = cv2.cornerSubPix(
                    self._picture, found, (TUNING.centre_px,) * 2, (-1, -1), _STOP)
                new = np.asarray(centred.reshape(-1, 2), np.float32)
            self._points = np.concatenate([self._points, new])
            self._ids = np.concatenate([self._ids, np.arange(self._count, self._count + len(new))])
            self._count += len(new)
        self._recorded = self._points
        step = np.full(len(self._points), len(self._steps) - 1.0)
        self._observations.append(np.column_stack([self._ids, step, self._points]))

    def _track(self, picture: Bytes, moved: float) -> bool:
        """Track the points into the next image; return whether enough of them are found."""
        if not len(self._points):
            return False
        expected = self._points + np.array([moved, 0.0], np.float32)
        found, is_found = self._optical_flow(self._picture, picture, self._points, expected)
        returned, is_found_back = self._optical_flow(
            picture, self._picture, found, self._points.copy())
        border, size = TUNING.border_px, (self._width, self._height)
        good = is_found & is_found_back
        good &= np.hypot(*(returned - self._points).T) < TUNING.round_trip_px
        good &= ((found > border) & (found < np.subtract(size, border + 1))).all(axis=1)
        if abs(moved) > TUNING.moved_px:
            good &= np.hypot(*(found - self._points).T) > TUNING.fixed_px
        if good.mean() < TUNING.min_tracked_share:
            return False
        self._points, self._recorded = found[good], self._recorded[good]
        self._ids, self._picture = self._ids[good], picture
        return True

    def _parallax(self) -> float:
        """Return how far the nearest quarter of the points moves besides the image, in pixels."""
        moved = self._points - self._recorded
        return float(np.quantile(np.hypot(moved[:, 0] - self._step[0], moved[:, 1]), 0.75))

    def _optical_flow(
        self, before: Bytes, after: Bytes, points: Places, guess: Places,
    ) -> tuple[Places, NDArray[np.bool_]]:
        found, state, _ = cv2.calcOpticalFlowPyrLK(
            before, after, points, guess, winSize=(self._window, self._window),
            maxLevel=TUNING.pyramid_levels, criteria=_STOP, flags=cv2.OPTFLOW_USE_INITIAL_FLOW)
        return np.asarray(found, np.float32), state.ravel() == 1
