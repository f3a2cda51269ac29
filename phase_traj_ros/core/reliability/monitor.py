# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Watches what the pairs of frames are worth.

The verdict is on the last minute. The spans of a drive in which it is against the result are kept.
"""

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from phase_traj_ros.core.reliability.reason import Evidence, Reason
from phase_traj_ros.core.reliability.spans import in_order, Spans
from phase_traj_ros.core.reliability.verdict import MOST_UNRELIABLE, Reliability

# Share of the moving pairs that has to be trusted.
_LEAST_TRUSTED = 0.5
# Above this share of pairs spoilt by a fixed pattern, it may have affected the others too.
_MOST_FIXED = 0.3
# A cause that spoils this share of the pairs is given as a reason.
_NAMED = 0.2
# With fewer pairs, no cause can be given.
_LEAST_PAIRS = 10
# Cuts per pair: a scene of a few frames does not show a turn.
_MOST_CUTS = 0.1
# Above this interval in seconds, a low frame rate explains why blocks do not agree.
_LOW_RATE = 0.25
# The verdict is on this time, which is kept in parts of a second.
_WINDOW_NS, _PART_NS = 60_000_000_000, 1_000_000_000
# A camera that repeats one picture for longer is frozen, and a distance that is not measured for
# longer is unknown: a car may have braked by 8 m/s.
_FROZEN_NS, _UNMEASURED_NS = 1_000_000_000, 1_000_000_000
# A road on which another motion stands out more is unclear if that was so this time before, too.
_UNCLEAR_NS = 1_000_000_000
# A longer gap than this, and than this many usual intervals, is a lost part of the drive.
_LOST_NS, _LOST_INTERVALS = 1_000_000_000, 2


class ReliabilityMonitor:
    """
    Counts what the pairs of the last minute are worth, and keeps the spans that are not reliable.

    Its memory does not grow with the length of the drive.
    """

    def __init__(self) -> None:
        """Make a monitor that has seen no pair."""
        self.reset()

    def reset(self) -> None:
        """Start again without pairs."""
        self._parts: deque[_Part] = deque()
        self._spans = {reason: Spans(apart_ns=_PART_NS) for reason in Reason}
        self._start_ns = self._newest_ns = self._new_picture_ns = self._judged_ns = 0
        self._measured_ns = 0
        self._rivalled_ns: int | None = None
        self._usual_ns = 0
        self._same_stamps = 0

    def add(
        self, evidence: Evidence, stamp_ns: int, interval_ns: int, *, contradicted: bool = False,
        measured: bool = True, rivalled: bool = False, frames: int = 1,
    ) -> None:
        """
        Take the next pair.

        Parameters
        ----------
        evidence
            What it is worth.
        stamp_ns
            Stamp of its second frame.
        interval_ns
            Time since its first frame.
        contradicted
            Whether the direction code contradicts the heading.
        measured
            Whether its distance is measured or given, if one is wanted in metres.
        rivalled
            Whether another motion of the road stands out more than the one that it is measured by.
        frames
            Number of its second frame minus that of its first one: it stands for so many pairs.

        """
        if not self._parts:
            self._start_ns = self._judged_ns = stamp_ns - interval_ns
            self._newest_ns = self._new_picture_ns = self._measured_ns = self._start_ns
        self._same_stamps = 0
        self._make_room(stamp_ns)
        part = self._parts[-1]
        before, self._newest_ns = self._newest_ns, stamp_ns
        if evidence is Evidence.REPEATED:
            if stamp_ns - self._new_picture_ns > _FROZEN_NS:
                self._spans[Reason.FROZEN].add(self._new_picture_ns, stamp_ns)
            return
        self._new_picture_ns = stamp_ns
        part.counts[evidence] += frames
        part.seconds += interval_ns * 1e-9
        if contradicted:
            self._spans[Reason.DIRECTION_CONTRADICTS_HEADING].add(before, stamp_ns)
        if rivalled:
            if self._rivalled_ns is not None and before - self._rivalled_ns < _UNCLEAR_NS:
                self._spans[Reason.ROAD_UNCLEAR].add(before, stamp_ns)
            self._rivalled_ns = stamp_ns
        if measured:
            self._measured_ns = stamp_ns
        elif stamp_ns - self._measured_ns > _UNMEASURED_NS:
            self._spans[Reason.DISTANCE_UNKNOWN].add(self._measured_ns, stamp_ns)
        if self._is_lost(evidence, interval_ns):
            self._spans[Reason.FRAMES_LOST].add(before, stamp_ns)
        else:
            self._usual_ns = interval_ns // frames

    def add_same_stamps(self, count: int) -> None:
        """Record frames with the stamp of the one before, which are not used."""
        self._same_stamps += count

    def add_cut(self) -> None:
        """Record a change of scene; its pair has been added like any other."""
        if self._parts:
            self._parts[-1].cuts += 1

    def verdict(self, *, camera_known: bool = True) -> Reliability:
        """
        Return whether the last minute is reliable, the reasons if it is not, and all spans so far.

        ``camera_known`` is False if angles were needed and the focal length is neither given nor
        learned from the drive. This concerns the whole drive.
        """
        start, end = self._start_ns, self._newest_ns
        reasons = self._reasons()
        spans = {reason: kept.of(reason in reasons, self._judged_ns, end)
                 for reason, kept in self._spans.items()}
        if self._unstamped_ns:
            end += self._unstamped_ns
            spans[Reason.FROZEN].append((self._newest_ns, end))
        reasons += [reason for reason in _IN_PARTS if self._is_against(reason)]
        if not camera_known and Reason.TOO_SHORT not in reasons:
            reasons.append(Reason.CAMERA_NOT_KNOWN)
            spans[Reason.CAMERA_NOT_KNOWN] = [(start, end)]
        return Reliability(tuple(reasons), in_order(spans), start, end)

    def _make_room(self, stamp_ns: int) -> None:
        """Begin a new part of the window where the last one is over, and drop the oldest."""
        parts = self._parts
        if parts and stamp_ns - parts[-1].start_ns < _PART_NS:
            return
        if parts and self._newest_ns - parts[0].start_ns >= _WINDOW_NS:
            # The verdict is that on its middle; that on the first one is on all before it as well.
            until = max(self._newest_ns - _WINDOW_NS // 2, self._judged_ns)
            for reason in self._reasons():
                self._spans[reason].add(self._judged_ns, until)
            self._judged_ns = until
        parts.append(_Part(stamp_ns))
        pairs = sum(part.counts.total() for part in parts)
        while (stamp_ns - parts[0].start_ns > _WINDOW_NS
                and pairs - parts[0].counts.total() >= _LEAST_PAIRS):
            pairs -= parts.popleft().counts.total()

    def _is_lost(self, evidence: Evidence, interval_ns: int) -> bool:
        """Return whether frames are missing in a pair, other than at a rate that is low anyway."""
        return self._usual_ns > 0 and interval_ns > _LOST_INTERVALS * self._usual_ns and (
            evidence is Evidence.APART or interval_ns > _LOST_NS)

    @property
    def _unstamped_ns(self) -> int:
        """Return for how long all frames have had one stamp, 0 if not for long."""
        lasted_ns = self._same_stamps * self._usual_ns
        return lasted_ns if lasted_ns > _FROZEN_NS else 0

    def _is_against(self, reason: Reason) -> bool:
        """Return whether the spans of a reason take too much of the window, or last."""
        end = self._newest_ns
        begin = max(self._start_ns, end - _WINDOW_NS)
        if reason is Reason.FROZEN and (
                self._unstamped_ns or end - self._new_picture_ns > _FROZEN_NS):
            return True
        return self._spans[reason].within(begin, end) > MOST_UNRELIABLE * (end - begin)

    def _reasons(self) -> list[Reason]:
        """Return what is wrong with the pairs of the window."""
        counts: Counter[Evidence] = sum((part.counts for part in self._parts), Counter())
        pairs = counts.total()
        if pairs < _LEAST_PAIRS:
            # Too few pairs to name a cause, but enough to see that none is in doubt.
            return [] if pairs and not self._distrust(counts) else [Reason.TOO_SHORT]
        reasons = self._distrust(counts)
        if sum(part.cuts for part in self._parts) > _MOST_CUTS * pairs:
            reasons.append(Reason.MANY_CUTS)
        return reasons

    def _distrust(self, counts: Mapping[Evidence, int]) -> list[Reason]:
        """Return why most pairs cannot be trusted; empty if they can, or if nothing moved."""
        pairs, apart = sum(counts.values()), counts[Evidence.APART]
        if apart > _LEAST_TRUSTED * pairs:
            return [Reason.NOT_COMPARED]
        judged = pairs - counts[Evidence.STILL] - apart
        # A few spoilt pairs do not count against a vehicle that is stationary for the rest.
        if judged < _NAMED * pairs:
            return []
        if counts[Evidence.TRUSTED] >= _LEAST_TRUSTED * judged:
            held = counts[Evidence.FIXED] >= _MOST_FIXED * judged
            return [Reason.VIEW_BLOCKED] if held else []
        spoilt = {kind: counts[kind] for kind in _REASONS}
        most = max(spoilt.values())
        named = [_REASONS[kind] for kind, count in spoilt.items()
                 if count == most or count >= _NAMED * judged]
        scattered = spoilt[Evidence.SCATTERED] + spoilt[Evidence.JERKED]
        seconds = sum(part.seconds for part in self._parts)
        if scattered >= _NAMED * judged and seconds / pairs >= _LOW_RATE:
            named.append(Reason.RATE_TOO_LOW)
        return named


_REASONS = {
    Evidence.BLANK: Reason.NOTHING_TO_SEE,
    Evidence.FIXED: Reason.VIEW_BLOCKED,
    Evidence.SCATTERED: Reason.NOT_ONE_MOTION,
    Evidence.JERKED: Reason.SHAKING,
}
# Reasons that concern parts of a drive, whatever the other pairs of the window are worth.
_IN_PARTS = (Reason.FROZEN, Reason.FRAMES_LOST, Reason.DISTANCE_UNKNOWN,
             Reason.ROAD_UNCLEAR, Reason.DIRECTION_CONTRADICTS_HEADING)


@dataclass(slots=True)
class _Part:
    """What a second of the window is worth."""

    start_ns: int
    counts: Counter[Evidence] = field(default_factory=Counter)
    cuts: int = 0
    seconds: float = 0.0
