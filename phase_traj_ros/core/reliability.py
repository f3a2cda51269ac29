# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides whether the result of a drive is reliable, and if not, why."""

from collections import Counter
from dataclasses import dataclass
from enum import Enum

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
# Share of the blocks that have to agree in a trusted pair.
_AGREEING = 0.3


class Reason(Enum):
    """Why a result is not reliable. The value is the word used in files and messages."""

    TOO_SHORT = 'too_short'
    NOTHING_TO_SEE = 'nothing_to_see'
    VIEW_BLOCKED = 'view_blocked'
    NOT_ONE_MOTION = 'not_one_motion'
    SHAKING = 'shaking'
    RATE_TOO_LOW = 'rate_too_low'
    MANY_CUTS = 'many_cuts'
    CAMERA_NOT_KNOWN = 'camera_not_known'
    NOT_COMPARED = 'not_compared'

    @property
    def sentence(self) -> str:
        """Return the reason as a sentence for users."""
        return _SENTENCES[self]


_SENTENCES = {
    Reason.TOO_SHORT: 'There are too few frames to judge, and the few are in doubt.',
    Reason.NOTHING_TO_SEE: 'Most images show too little: they are dark or blank, or the lens is'
                           ' covered.',
    Reason.VIEW_BLOCKED: 'Most of what the images show is fixed to the camera, such as drops or'
                         ' dirt on the windscreen.',
    Reason.NOT_ONE_MOTION: 'The parts of the image do not move as seen from one vehicle in a'
                           ' static world.',
    Reason.SHAKING: 'The camera turns back and forth faster than a vehicle can.',
    Reason.RATE_TOO_LOW: 'The frames are too far apart in time: give more frames per second.',
    Reason.MANY_CUTS: 'The video is cut into scenes that are too short to show a turn.',
    Reason.CAMERA_NOT_KNOWN: 'The turns do not determine the focal length well enough: give'
                             ' hfov_deg or a calibration.',
    Reason.NOT_COMPARED: 'Most frames cannot be compared with the one before: they are further'
                         ' apart than max_gap, or they differ in size or encoding.',
}


class Evidence(Enum):
    """What a pair of frames is worth for the result."""

    TRUSTED = 'trusted'
    STILL = 'still'
    """The vehicle was stationary: neither for nor against."""
    BLANK = 'blank'
    """The image holds only noise."""
    FIXED = 'fixed'
    """What agrees is fixed to the camera."""
    SCATTERED = 'scattered'
    """The parts of the image do not agree on a motion."""
    JERKED = 'jerked'
    """They agree, but no vehicle turns like that."""
    APART = 'apart'
    """The frames could not be compared: against the result only if most pairs are like that."""


@dataclass(frozen=True, slots=True)
class Reliability:
    """Whether a result is reliable; ``reasons`` is empty if it is."""

    reasons: tuple[Reason, ...] = ()

    @property
    def reliable(self) -> bool:
        """Return whether the result is reliable."""
        return not self.reasons

    @property
    def words(self) -> tuple[str, ...]:
        """Return the reasons as the words used in files and messages."""
        return tuple(reason.value for reason in self.reasons)


def evidence_of(
    *, agreement: float | None, still: bool = False, blank: bool = False, fixed: bool = False,
    bridged: bool = False,
) -> Evidence:
    """
    Return what a pair is worth.

    Parameters
    ----------
    agreement
        Share of the blocks that agree on the camera's rotation, 0 to 1; None if the frames
        could not be compared (a gap, another size).
    still
        Whether the vehicle was stationary.
    blank
        Whether the image held only noise.
    fixed
        Whether only fixed areas may have agreed, or too little else is left.
    bridged
        Whether the yaw was rejected.

    """
    if agreement is None:
        return Evidence.APART
    if still:
        return Evidence.STILL
    if blank:
        return Evidence.BLANK
    if fixed:
        return Evidence.FIXED
    if agreement < _AGREEING:
        return Evidence.SCATTERED
    return Evidence.JERKED if bridged else Evidence.TRUSTED


class ReliabilityMonitor:
    """Counts what the pairs of a drive are worth, and sums them up at any time."""

    def __init__(self) -> None:
        """Make a monitor that has seen no pair."""
        self.reset()

    def reset(self) -> None:
        """Start again without pairs."""
        self._counts: Counter[Evidence] = Counter()
        self._cuts = 0
        self._seconds = 0.0

    def add(self, evidence: Evidence, interval: float) -> None:
        """Take the next pair, whose frames are ``interval`` seconds apart."""
        self._counts[evidence] += 1
        self._seconds += interval

    def add_cut(self) -> None:
        """Record a change of scene; its pair has been added like any other."""
        self._cuts += 1

    def verdict(self, *, camera_known: bool = True) -> Reliability:
        """
        Return whether the drive so far is reliable, and the reasons if it is not.

        ``camera_known`` is False if angles were needed and the focal length is neither given nor
        learned from the drive.
        """
        pairs = self._counts.total()
        if pairs < _LEAST_PAIRS:
            # Too few pairs to name a cause, but enough to see that none is in doubt.
            return Reliability(() if pairs and not self._distrust(pairs) else (Reason.TOO_SHORT,))
        reasons = self._distrust(pairs)
        if self._cuts > _MOST_CUTS * pairs:
            reasons.append(Reason.MANY_CUTS)
        if not camera_known:
            reasons.append(Reason.CAMERA_NOT_KNOWN)
        return Reliability(tuple(reasons))

    def _distrust(self, pairs: int) -> list[Reason]:
        """Return why most pairs cannot be trusted; empty if they can, or if nothing moved."""
        apart = self._counts[Evidence.APART]
        if apart > _LEAST_TRUSTED * pairs:
            return [Reason.NOT_COMPARED]
        judged = pairs - self._counts[Evidence.STILL] - apart
        # A few spoilt pairs do not count against a vehicle that is stationary for the rest.
        if judged < _NAMED * pairs:
            return []
        if self._counts[Evidence.TRUSTED] >= _LEAST_TRUSTED * judged:
            held = self._counts[Evidence.FIXED] >= _MOST_FIXED * judged
            return [Reason.VIEW_BLOCKED] if held else []
        spoilt = {kind: self._counts[kind] for kind in _REASONS}
        most = max(spoilt.values())
        named = [_REASONS[kind] for kind, count in spoilt.items()
                 if count == most or count >= _NAMED * judged]
        scattered = spoilt[Evidence.SCATTERED] + spoilt[Evidence.JERKED]
        if scattered >= _NAMED * judged and self._seconds / pairs >= _LOW_RATE:
            named.append(Reason.RATE_TOO_LOW)
        return named


_REASONS = {
    Evidence.BLANK: Reason.NOTHING_TO_SEE,
    Evidence.FIXED: Reason.VIEW_BLOCKED,
    Evidence.SCATTERED: Reason.NOT_ONE_MOTION,
    Evidence.JERKED: Reason.SHAKING,
}
