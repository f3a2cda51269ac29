# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the result of a drive can be relied upon, and if not, why."""

from collections import Counter
from dataclasses import dataclass
from enum import Enum

# Share of the pairs in which something moved that has to be trusted.
_LEAST_TRUSTED = 0.5
# Where a fixed pattern spoils this share, it may have held the others, too.
_MOST_FIXED = 0.3
# What spoils this share of the pairs is named as a reason.
_NAMED = 0.2
# So few pairs do not tell why they cannot be trusted.
_LEAST_PAIRS = 10
# Cuts per pair: a scene of a few frames shows no turn.
_MOST_CUTS = 0.1
# Frames farther apart than this, in seconds, are a reason for their blocks not to agree.
_LOW_RATE = 0.25
# Share of the blocks that agree in a pair that is trusted.
_AGREEING = 0.3


class Reason(Enum):
    """Why a result is not to be relied upon; the value is the word in files and messages."""

    TOO_SHORT = 'too_short'
    NOTHING_TO_SEE = 'nothing_to_see'
    VIEW_BLOCKED = 'view_blocked'
    NOT_ONE_MOTION = 'not_one_motion'
    SHAKING = 'shaking'
    RATE_TOO_LOW = 'rate_too_low'
    MANY_CUTS = 'many_cuts'
    CAMERA_NOT_KNOWN = 'camera_not_known'

    @property
    def sentence(self) -> str:
        """Return the reason as a sentence for people."""
        return _SENTENCES[self]


_SENTENCES = {
    Reason.TOO_SHORT: 'There are too few frames to tell anything, and what they show is in doubt.',
    Reason.NOTHING_TO_SEE: 'Most pictures show too little: they are dark or blank, or the lens is'
                           ' covered.',
    Reason.VIEW_BLOCKED: 'Most of what the pictures show is fixed to the camera, such as drops or'
                         ' dirt on the windscreen.',
    Reason.NOT_ONE_MOTION: 'The parts of the picture do not move as seen from one vehicle in a'
                           ' world at rest.',
    Reason.SHAKING: 'The camera turns to and fro faster than a vehicle can.',
    Reason.RATE_TOO_LOW: 'The frames are too far apart in time: give more frames per second.',
    Reason.MANY_CUTS: 'The film is cut into scenes too short to show a turn.',
    Reason.CAMERA_NOT_KNOWN: 'The turns do not tell the focal length well enough: give hfov_deg or'
                             ' a calibration.',
}


class Evidence(Enum):
    """What a pair of frames is worth for the result."""

    TRUSTED = 'trusted'
    STILL = 'still'
    """The vehicle stood, or the pair was not to be compared: neither for nor against."""
    BLANK = 'blank'
    """Nothing but noise is seen."""
    FIXED = 'fixed'
    """What agrees is fixed to the camera."""
    SCATTERED = 'scattered'
    """The parts of the picture do not agree on a motion."""
    JERKED = 'jerked'
    """They do, but no vehicle turns like that."""


@dataclass(frozen=True, slots=True)
class Reliability:
    """Whether a result can be relied upon; the reasons are why not, and empty if it can."""

    reasons: tuple[Reason, ...] = ()

    @property
    def reliable(self) -> bool:
        """Return whether the result can be relied upon."""
        return not self.reasons

    @property
    def words(self) -> tuple[str, ...]:
        """Return the reasons as they stand in files and messages."""
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
        Share of the blocks that agree on the camera's rotation, 0 to 1; None where the frames
        were not to be compared (a gap, another size).
    still
        Whether the vehicle stood.
    blank
        Whether there was nothing but noise to see.
    fixed
        Whether nothing but what is fixed to the camera may have agreed, or not enough is left.
    bridged
        Whether the yaw was not believed.

    """
    if still or agreement is None:
        return Evidence.STILL
    if blank:
        return Evidence.BLANK
    if fixed:
        return Evidence.FIXED
    if agreement < _AGREEING:
        return Evidence.SCATTERED
    return Evidence.JERKED if bridged else Evidence.TRUSTED


class ReliabilityMonitor:
    """Counts what the pairs of a drive are worth, and sums it up at any time."""

    def __init__(self) -> None:
        """Make a monitor that has seen no pair."""
        self.reset()

    def reset(self) -> None:
        """Start anew, as the codes do."""
        self._counts: Counter[Evidence] = Counter()
        self._cuts = 0
        self._seconds = 0.0

    def add(self, evidence: Evidence, interval: float) -> None:
        """Take the next pair, whose frames are ``interval`` seconds apart."""
        self._counts[evidence] += 1
        self._seconds += interval

    def add_cut(self) -> None:
        """Take note of a change of scene; its pair has been added as any other."""
        self._cuts += 1

    def verdict(self, *, camera_known: bool = True) -> Reliability:
        """
        Return what there is to say of the drive so far.

        ``camera_known`` is False where angles were needed and the focal length is neither given
        nor settled by the drive.
        """
        pairs = self._counts.total()
        if pairs < _LEAST_PAIRS:
            # Too few to say what is wrong, but not to see that nothing is.
            return Reliability(() if pairs and not self._distrust(pairs) else (Reason.TOO_SHORT,))
        reasons = self._distrust(pairs)
        if self._cuts > _MOST_CUTS * pairs:
            reasons.append(Reason.MANY_CUTS)
        if not camera_known:
            reasons.append(Reason.CAMERA_NOT_KNOWN)
        return Reliability(tuple(reasons))

    def _distrust(self, pairs: int) -> list[Reason]:
        """Return why most pairs cannot be trusted; empty if they can, or nothing has moved."""
        judged = pairs - self._counts[Evidence.STILL]
        # A few pairs that pass by while the vehicle stands do not spoil its standing.
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
