# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides which frames of a stream are used, by their stamps alone, live and offline alike."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
import math
from statistics import median_low
from typing import Generic, TypeVar

from phase_traj_ros.core.frames.tuning import TUNING

_FrameT = TypeVar('_FrameT')


@dataclass(frozen=True, slots=True)
class Passed(Generic[_FrameT]):
    """A frame to use."""

    frame: _FrameT
    stamp_ns: int
    restarts: bool = False
    """Whether the stream starts anew with this frame, as a bag that is played in a loop does."""


class StampGate(Generic[_FrameT]):
    """
    Passes on frames whose stamps increase, and drops the others.

    A frame whose stamp jumps by more than a second is held until the next one arrives. If the next
    stamp continues from there, the jump was a gap, or a restart: backward, or more than a day
    ahead after the first frame. Otherwise the frame is an outlier and is dropped. A frame that is
    at most a second late is dropped at once: neighbours were swapped, or a clock was set back.
    """

    def __init__(self) -> None:
        """Make a gate before the first frame."""
        self.repeated = 0
        """Number of frames dropped so far because their stamp equals the previous one."""
        self.dropped = 0
        """Number of frames dropped so far because their stamp is late or an outlier."""
        self._newest_ns: int | None = None
        # The newest three: one may be a gap.
        self._intervals_ns: deque[int] = deque(maxlen=3)
        self._held: Passed[_FrameT] | None = None

    def push(self, frame: _FrameT, stamp_ns: int) -> Iterator[Passed[_FrameT]]:
        """
        Take the next frame; yield the frames to use now, none to two, in order.

        The iterator has to be exhausted before the next call. The frame may be anything that
        belongs to the stamp, the time of the exposure in nanoseconds.
        """
        if self._held is not None and stamp_ns == self._held.stamp_ns:
            self.repeated += 1
            return
        yield from self._settle(stamp_ns)
        step_ns = None if self._newest_ns is None else stamp_ns - self._newest_ns
        usual_ns = median_low(self._intervals_ns) if self._intervals_ns else 0
        longest_ns = max(TUNING.jump_ns, TUNING.jump_intervals * usual_ns)
        if step_ns is None or 0 < step_ns <= longest_ns:
            yield self._use(Passed(frame, stamp_ns))
        elif step_ns == 0:
            self.repeated += 1
        elif -TUNING.jump_ns <= step_ns < 0:
            self.dropped += 1
        else:
            clock_set = not self._intervals_ns and step_ns > TUNING.clock_set_ns
            self._held = Passed(frame, stamp_ns, restarts=step_ns < 0 or clock_set)

    def finish(self) -> Iterator[Passed[_FrameT]]:
        """End the stream: yield a frame held after a forward jump, drop one after a backward."""
        yield from self._settle(math.inf)

    def _settle(self, stamp_ns: float) -> Iterator[Passed[_FrameT]]:
        """Yield the held frame if a stamp continues from it, not from the newest; else drop it."""
        held, self._held = self._held, None
        if held is None or self._newest_ns is None:
            return
        backward = held.stamp_ns < self._newest_ns
        if held.stamp_ns < stamp_ns and not (backward and stamp_ns >= self._newest_ns):
            yield self._use(held)
        else:
            self.dropped += 1

    def _use(self, passed: Passed[_FrameT]) -> Passed[_FrameT]:
        if self._newest_ns is None or passed.restarts:
            self._intervals_ns.clear()
        else:
            self._intervals_ns.append(passed.stamp_ns - self._newest_ns)
        self._newest_ns = passed.stamp_ns
        return passed
