# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Counts received, lost and rejected images, and measures times; it does not need rclpy."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
import statistics

from phase_traj_ros.io.params_file import config_folder

_KEPT = 1000
# A larger step of the numbers of messages comes from another publisher.
_LONGEST_LOSS = 10_000

PROFILE = 'fastdds_large_images.xml'
# Either variable names a profile file; the first is the older name.
_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
# Default size of the shared memory of Fast DDS; a profile can change it.
_SEGMENT_BYTES = 512 * 1024


class Stage(Enum):
    """Processing stages of an image, in this order."""

    RECEIVE = 'receive'
    """Waiting in this process until the callback starts."""
    CONVERT = 'convert'
    """Decoding and conversion to greyscale."""
    MEASURE = 'measure'
    """Comparison with earlier images: shift, yaw and distance."""
    CODE = 'code'
    """Judgement, heading, codes and path."""
    PUBLISH = 'publish'
    """Making and publishing the messages."""


class LossCounter:
    """
    Counts the messages that were sent on a topic and not received.

    Each publisher numbers its own messages, but a message does not name its publisher: of
    several, no loss is known.
    """

    def __init__(self, publishers: Callable[[], int]) -> None:
        """Make a counter before the first message; ``publishers`` returns their number."""
        self._publishers = publishers
        self._last: int | None = None

    def update(self, sequence_number: int | None) -> int:
        """Return the number of messages missing before the one with this sequence number."""
        last, self._last = self._last, sequence_number
        if last is None or sequence_number is None:
            return 0
        missing = sequence_number - last - 1
        return missing if 0 < missing <= _LONGEST_LOSS and self._publishers() == 1 else 0


@dataclass(slots=True)
class Health:
    """Counters and processing times of a node. Medians are over the newest 1000 images."""

    images: int = 0
    """Images received, including unusable ones."""
    lost: int = 0
    """Images published but not processed: lost in transport, or replaced by newer ones."""
    image_bytes: int = 0
    """Size of the newest image as received."""
    bad: int = 0
    """Images that could not be used."""
    last_error: str = ''
    """Why the last unusable image could not be used."""
    last_arrival_ns: int | None = None
    """Arrival time of the newest image, by a steady clock."""
    responses: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _stages: dict[Stage, deque[int]] = field(
        default_factory=lambda: {stage: deque(maxlen=_KEPT) for stage in Stage})
    _taken: tuple[int, int] = (0, 0)
    _totals: deque[int] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _arrivals: deque[int] = field(default_factory=lambda: deque(maxlen=100))

    def arrived(self, now_ns: int, *, lost: int, size: int = 0) -> None:
        """Count an image of ``size`` bytes; ``now_ns`` is the time of a steady clock."""
        self.images += 1
        self.lost += lost
        self.image_bytes = size
        self.last_arrival_ns = now_ns
        self._arrivals.append(now_ns)

    def rejected(self, reason: str) -> None:
        """Count an image that could not be used."""
        self.bad += 1
        self.last_error = reason

    def take_faults(self) -> tuple[int, int]:
        """Return how many images were unusable, and lost, since the last call."""
        before, self._taken = self._taken, (self.bad, self.lost)
        return self.bad - before[0], self.lost - before[1]

    def took(self, stage: Stage, nanoseconds: int) -> None:
        """Record the duration of a stage for one image."""
        self._stages[stage].append(nanoseconds)

    def took_in_all(self, nanoseconds: int) -> None:
        """Record the time of one image from its arrival in this process to the last message."""
        self._totals.append(nanoseconds)

    def rate(self, now_ns: int) -> float:
        """Return the rate of the newest images in Hz, 0 before the second image."""
        arrivals = self._arrivals
        if len(arrivals) < 2 or now_ns == arrivals[0]:
            return 0.0
        # Up to now, so that the rate falls when no more images arrive.
        return (len(arrivals) - 1) / max(now_ns - arrivals[0], 1) * 1e9

    def microseconds(self, stage: Stage) -> float:
        """Return the median time of a stage, 0 before the first image."""
        return statistics.median(self._stages[stage] or [0]) / 1e3

    def milliseconds(self, share: float) -> float:
        """Return the quantile ``share`` of the time per image, over all stages."""
        totals = sorted(self._totals or [0])
        return totals[min(int(share * len(totals)), len(totals) - 1)] / 1e6

    def response(self) -> float:
        """Return the median response, 0 before the first pair."""
        return statistics.median(self.responses or [0.0])


def advice(image_bytes: int, middleware: str, environment: Mapping[str, str]) -> str:
    """
    Return what to do about lost images, as the end of a sentence.

    Parameters
    ----------
    image_bytes
        Size of an image as received.
    middleware
        Name of the middleware implementation, such as ``rmw_fastrtps_cpp``.
    environment
        Environment variables of this process.

    """
    profiled = any(environment.get(name) for name in _VARIABLES)
    if image_bytes > _SEGMENT_BYTES // 2 and 'fastrtps' in middleware and not profiled:
        return (f'an image of {image_bytes / 1e6:.1f} MB is too large for the default shared'
                f' memory of Fast DDS: set {_VARIABLES[0]}={config_folder() / PROFILE} for the'
                ' camera driver and for this node')
    return ('the network loses them, or they arrive faster than they are processed: see p99 in'
            ' /diagnostics; fewer images per second, or smaller ones, reduce the processing time')
