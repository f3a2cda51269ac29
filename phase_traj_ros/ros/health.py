# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How the node fares: what came, what was lost, how long it took. Knows nothing of rclpy."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
import statistics

_KEPT = 1000
# Sequence numbers further apart than this are those of another publisher.
_LONGEST_LOSS = 10_000


class Stage(Enum):
    """What happens to an image, in this order."""

    RECEIVE = 'receive'
    """From its arrival in this process until its turn comes."""
    CONVERT = 'convert'
    """Decoding and conversion to grey."""
    CORRELATE = 'correlate'
    """Phase correlation with the image before."""
    CODE = 'code'
    """State machine and path."""
    PUBLISH = 'publish'
    """Making and publishing the messages."""


class LossCounter:
    """Counts the messages that a publisher has sent and that have not been handled."""

    def __init__(self) -> None:
        """Make a counter that has seen no message."""
        self._last: int | None = None

    def update(self, sequence_number: int | None) -> int:
        """Return how many messages are missing before the one of this number."""
        last, self._last = self._last, sequence_number
        if last is None or sequence_number is None:
            return 0
        missing = sequence_number - last - 1
        return missing if 0 < missing <= _LONGEST_LOSS else 0


@dataclass(slots=True)
class Health:
    """Figures about the life of a node; the newest 1000 images count for the medians."""

    images: int = 0
    """Images received, bad ones included."""
    lost: int = 0
    """Images published but not handled: lost on the way, or replaced by newer ones."""
    image_bytes: int = 0
    """Size of the newest image as it came."""
    bad: int = 0
    """Images that could not be used."""
    last_error: str = ''
    """Why the last of them could not."""
    last_arrival_ns: int | None = None
    """When the newest image came, by a steady clock."""
    responses: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _stages: dict[Stage, deque[int]] = field(
        default_factory=lambda: {stage: deque(maxlen=_KEPT) for stage in Stage})
    _totals: deque[int] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _arrivals: deque[int] = field(default_factory=lambda: deque(maxlen=100))

    def arrived(self, now_ns: int, *, lost: int, size: int = 0) -> None:
        """Count an image of ``size`` bytes; ``now_ns`` by a steady clock."""
        self.images += 1
        self.lost += lost
        self.image_bytes = size
        self.last_arrival_ns = now_ns
        self._arrivals.append(now_ns)

    def rejected(self, reason: str) -> None:
        """Count an image that could not be used."""
        self.bad += 1
        self.last_error = reason

    def took(self, stage: Stage, nanoseconds: int) -> None:
        """Note how long a stage took for one image."""
        self._stages[stage].append(nanoseconds)

    def took_in_all(self, nanoseconds: int) -> None:
        """Note how long an image took from its arrival in this process to the last message."""
        self._totals.append(nanoseconds)

    def rate(self, now_ns: int) -> float:
        """Return the rate of images over the last of them, in Hz, 0 where none come."""
        arrivals = self._arrivals
        if len(arrivals) < 2 or now_ns == arrivals[0]:
            return 0.0
        # Up to now, so that the rate falls when no more come.
        return (len(arrivals) - 1) / max(now_ns - arrivals[0], 1) * 1e9

    def microseconds(self, stage: Stage) -> float:
        """Return the median time of a stage, 0 before the first image."""
        return _median(self._stages[stage]) / 1e3

    def milliseconds(self, share: float) -> float:
        """Return what that share of the images took at most, all stages together."""
        totals = sorted(self._totals)
        return totals[min(int(share * len(totals)), len(totals) - 1)] / 1e6 if totals else 0.0

    def response(self) -> float:
        """Return the median response, 0 before the first pair."""
        return _median(self.responses)


def _median(values: Iterable[float]) -> float:
    kept = list(values)
    return statistics.median(kept) if kept else 0.0
