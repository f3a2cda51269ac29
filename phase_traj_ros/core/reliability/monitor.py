# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Monitors the evidence of the pairs of frames.

The verdict is on the last minute. The unreliable spans of a drive are kept.
"""

from collections import Counter, deque
from dataclasses import dataclass, field

from phase_traj_ros.core.reliability.reason import Evidence, Reason
from phase_traj_ros.core.reliability.scene_distance import SceneDistance
from phase_traj_ros.core.reliability.tuning import TUNING
from phase_traj_ros.core.reliability.verdict import in_order, Reliability, Spans
from phase_traj_ros.core.road.travel import Travel


class ReliabilityMonitor:
    """
    Counts the evidence of the last minute, and keeps the unreliable spans.

    Its memory does not grow with the length of the drive.
    """

    def __init__(self) -> None:
        """Make a monitor that has seen no pair."""
        self._parts: deque[_Part] = deque()
        # The sum of those of the parts.
        self._counts: Counter[Evidence] = Counter()
        self._spans = {reason: Spans() for reason in Reason}
        self._start_ns = self._newest_ns = self._new_picture_ns = self._judged_ns = 0
        self._seen_ns = self._measured_ns = 0
        self._rivalled_ns: int | None = None
        self._scene = SceneDistance()
        self._usual_ns = self._still_ns = 0
        # Repeated pictures since the newest other one.
        self._repeats = 0
        # The frames since the newest one that are not used, by their reasons.
        self._unused: Counter[Reason] = Counter()

    def add(
        self, evidence: Evidence, stamp_ns: int, interval_ns: int, *, seen: bool = True,
        stands: bool = False, travel: Travel | None = None, near: float = 0.0, metric: bool = True,
        camera_known: bool = True, contradicted: bool = False, cut: bool = False, frames: int = 1,
        missed: float = 0.0,
    ) -> None:
        """
        Add the next pair.

        ``seen``: its motion was measured. ``stands``: the vehicle stands. ``travel``: its
        distance, if there is one; it has to be known if it is ``metric``. ``near``: that of its
        ``CameraMotion``, 0 if there is none. ``camera_known``: the distance needs no camera, or it
        is known. ``contradicted``: the direction code contradicts the heading. ``cut``: the scene
        changed in the previous pair. ``frames``: number of the second frame minus that of the
        first one; the pair counts as so many. ``missed``: that of its ``HeadingStep``.
        """
        if not self._parts:
            self._start_ns = self._judged_ns = stamp_ns - interval_ns
            self._newest_ns = self._new_picture_ns = self._start_ns
            self._seen_ns = self._measured_ns = self._start_ns
        self._unused.clear()
        self._make_room(stamp_ns)
        part = self._parts[-1]
        before, self._newest_ns = self._newest_ns, stamp_ns
        if evidence is Evidence.REPEATED:
            self._repeats += 1
            if stamp_ns - self._new_picture_ns > TUNING.frozen_ns:
                self._spans[Reason.FROZEN].add(self._new_picture_ns, stamp_ns)
            return
        self._new_picture_ns = stamp_ns
        part.counts[evidence] += frames
        self._counts[evidence] += frames
        unseen_ns = stamp_ns - before - (frames - 1 - self._repeats) * self._usual_ns
        lost = self._is_lost(evidence, interval_ns, unseen_ns)
        self._repeats = 0
        if not lost:
            part.seconds += interval_ns * 1e-9
        part.cuts += cut
        if stands:
            self._still_ns += interval_ns
        part.missed += missed ** 2
        if seen:
            self._seen_ns = stamp_ns
        elif evidence in _REASONS and stamp_ns - self._seen_ns > TUNING.unmeasured_ns:
            self._spans[_REASONS[evidence]].add(self._seen_ns, stamp_ns)
            if evidence in _SCATTERED and self._frames_are_far:
                self._spans[Reason.RATE_TOO_LOW].add(self._seen_ns, stamp_ns)
        if not camera_known:
            self._spans[Reason.CAMERA_NOT_KNOWN].add(before, stamp_ns)
        if contradicted:
            self._spans[Reason.DIRECTION_CONTRADICTS_HEADING].add(before, stamp_ns)
        if cut:
            self._scene = SceneDistance()
        if travel is None:
            self._measured_ns = stamp_ns
        else:
            self._add_travel(travel, near, before, interval_ns, metric=metric)
        if lost:
            self._spans[Reason.FRAMES_LOST].add(before, stamp_ns)
        else:
            self._usual_ns = interval_ns // frames

    def _add_travel(
        self, travel: Travel, near: float, before: int, interval_ns: int, *, metric: bool,
    ) -> None:
        """Add the distance of the newest pair; ``before`` is the stamp of the frame before it."""
        spans, stamp_ns = self._spans, self._newest_ns
        slowed = self._scene.contradicts(travel, near, interval_ns * 1e-9)
        if slowed or (travel.rivalled and (metric or travel.known)):
            if self._rivalled_ns is not None and before - self._rivalled_ns < TUNING.unclear_ns:
                spans[Reason.ROAD_UNCLEAR].add(before, stamp_ns)
            self._rivalled_ns = stamp_ns
        if travel.refuted:
            until = stamp_ns - interval_ns
            since = max(until - round(travel.refuted * 1e9), self._start_ns)
            spans[Reason.ROAD_UNCLEAR].add(since, until)
        if not metric or travel.measured:
            self._measured_ns = stamp_ns
        elif stamp_ns - self._measured_ns > TUNING.unmeasured_ns:
            spans[Reason.DISTANCE_UNKNOWN].add(self._measured_ns, stamp_ns)
        elif not travel.known:
            spans[Reason.DISTANCE_UNKNOWN].add(before, stamp_ns)

    def add_unused(self, reason: Reason, count: int = 1) -> None:
        """Add frames that are not used, because ``FROZEN`` stamps repeat or ``FRAMES_LOST``."""
        self._unused[reason] += count

    def verdict(self, *, camera_reason: Reason | None = None) -> Reliability:
        """
        Return whether the last minute is reliable, the reasons if it is not, and all spans so far.

        ``camera_reason`` is the one against the camera, if any. It concerns the whole drive.
        """
        start, end = self._start_ns, self._newest_ns
        reasons = self._reasons()
        spans = {reason: kept.of(reason in reasons, self._judged_ns, end)
                 for reason, kept in self._spans.items()}
        for reason in self._unused:
            if lasted_ns := self._unused_ns(reason):
                spans[reason].append((self._newest_ns, self._newest_ns + lasted_ns))
                end = max(end, self._newest_ns + lasted_ns)
        reasons += [reason for reason in Reason if reason not in reasons and self._applies(reason)]
        if not any(_REASONS[each] in reasons for each in _SCATTERED):
            # It explains those, which do not count.
            reasons = [reason for reason in reasons if reason is not Reason.RATE_TOO_LOW]
        if camera_reason is not None and Reason.TOO_SHORT not in reasons:
            spans[camera_reason] = [(start, end)]
            if camera_reason not in reasons:
                reasons.append(camera_reason)
        return Reliability(tuple(reasons), in_order(spans), start, end, self._still_ns)

    def _make_room(self, stamp_ns: int) -> None:
        """Begin a new part of the window where the last one is over, and drop the oldest."""
        parts = self._parts
        if parts and stamp_ns - parts[-1].start_ns < TUNING.part_ns:
            return
        if parts and self._newest_ns - parts[0].start_ns >= TUNING.window_ns:
            # The verdict applies to the middle of the window, the first one also to all before it.
            until = max(self._newest_ns - TUNING.window_ns // 2, self._judged_ns)
            for reason in self._reasons():
                self._spans[reason].add(self._judged_ns, until)
            self._judged_ns = until
        parts.append(_Part(stamp_ns))
        while (stamp_ns - parts[0].start_ns > TUNING.window_ns
                and (self._counts - parts[0].counts).total() >= TUNING.min_pairs):
            self._counts -= parts.popleft().counts

    @property
    def _frames_are_far(self) -> bool:
        """Return whether the frames of the window are so far apart that blocks are scattered."""
        seconds = sum(part.seconds for part in self._parts)
        return seconds >= TUNING.low_rate_s * self._counts.total()

    def _is_lost(self, evidence: Evidence, interval_ns: int, unseen_ns: int) -> bool:
        """Return whether frames are missing in a pair, not only at a low frame rate."""
        return 0 < TUNING.lost_intervals * self._usual_ns < unseen_ns and (
            evidence is Evidence.APART or interval_ns > TUNING.lost_ns)

    def _unused_ns(self, reason: Reason) -> int:
        """Return how long all frames have not been used; 0 if that is not longer than usual."""
        lasted_ns = self._unused[reason] * self._usual_ns
        return lasted_ns if lasted_ns > TUNING.lost_ns else 0

    def _applies(self, reason: Reason) -> bool:
        """Return whether the spans of a reason cover too much of the window, or continue."""
        end = self._newest_ns
        begin = max(self._start_ns, end - TUNING.window_ns)
        if self._unused_ns(reason) or (
                reason is Reason.FROZEN and end - self._new_picture_ns > TUNING.frozen_ns):
            return True
        return self._spans[reason].within(begin, end) > TUNING.max_unreliable * (end - begin)

    def _reasons(self) -> list[Reason]:
        """Return the reasons against the pairs of the window."""
        pairs = self._counts.total()
        if pairs < TUNING.min_pairs:
            # Too few pairs to give a cause, but they may all be trusted.
            return [] if pairs and not self._distrust() else [Reason.TOO_SHORT]
        reasons = self._distrust()
        if sum(part.cuts for part in self._parts) > TUNING.max_cuts * pairs:
            reasons.append(Reason.MANY_CUTS)
        if sum(part.missed for part in self._parts) > TUNING.max_missed ** 2:
            reasons.append(Reason.HEADING_UNKNOWN)
        return reasons

    def _distrust(self) -> list[Reason]:
        """Return why most pairs cannot be trusted; empty if they can, or if nothing moved."""
        counts = self._counts
        pairs, apart = counts.total(), counts[Evidence.APART]
        if apart > TUNING.min_trusted * pairs:
            return [Reason.NOT_COMPARED]
        judged = pairs - counts[Evidence.STILL] - apart
        # A few spoilt pairs do not count against a vehicle that is stationary for the rest.
        if judged < TUNING.min_cause_share * pairs:
            return []
        if counts[Evidence.TRUSTED] >= TUNING.min_trusted * judged:
            held = counts[Evidence.FIXED] >= TUNING.max_fixed * judged
            return [Reason.VIEW_BLOCKED] if held else []
        spoilt = {kind: counts[kind] for kind in _REASONS}
        most = max(spoilt.values())
        named = [_REASONS[kind] for kind, count in spoilt.items()
                 if count == most or count >= TUNING.min_cause_share * judged]
        scattered = sum(spoilt[each] for each in _SCATTERED)
        if scattered >= TUNING.min_cause_share * judged and self._frames_are_far:
            named.append(Reason.RATE_TOO_LOW)
        return named


_REASONS = {
    Evidence.BLANK: Reason.NOTHING_TO_SEE,
    Evidence.FIXED: Reason.VIEW_BLOCKED,
    Evidence.SCATTERED: Reason.NOT_ONE_MOTION,
    Evidence.JERKED: Reason.SHAKING,
}
# What a low frame rate may explain.
_SCATTERED = (Evidence.SCATTERED, Evidence.JERKED)


@dataclass(slots=True)
class _Part:
    """The evidence of one second of the window."""

    start_ns: int
    counts: Counter[Evidence] = field(default_factory=Counter)
    cuts: int = 0
    missed: float = 0.0
    seconds: float = 0.0
