# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames of a camera as they come: in order to the estimator, the others counted."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeAlias, TypeVar

from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.estimator import TrajectoryEstimator
from phase_traj_ros.core.stamps import Passed, StampGate
from phase_traj_ros.core.update import Update
from phase_traj_ros.errors import FrameError


class Stamped(Protocol):
    """What a stream has to know of a frame."""

    @property
    def image(self) -> Frame:
        """Return the grey values, (H, W)."""

    @property
    def stamp_ns(self) -> int:
        """Return the time of the exposure in nanoseconds."""

    @property
    def encoding(self) -> str:
        """Return the encoding of the source image; empty if not known."""


FrameT = TypeVar('FrameT')
_StampedT = TypeVar('_StampedT', bound=Stamped)


@dataclass(frozen=True, slots=True)
class Restarted:
    """The stamps jumped and go on from there: the results so far are forgotten after this."""

    newest_ns: int
    """Newest stamp before."""
    stamp_ns: int
    """Stamp that follows it."""


@dataclass(frozen=True, slots=True)
class Started(Generic[FrameT]):
    """The first frame, at the start or after a restart."""

    frame: FrameT


@dataclass(frozen=True, slots=True)
class Measured(Generic[FrameT]):
    """A pair of frames was measured; ``frame`` is its second one."""

    frame: FrameT
    update: Update


@dataclass(frozen=True, slots=True)
class Skipped(Generic[FrameT]):
    """A frame cannot be used; the next pair spans it."""

    frame: FrameT
    reason: str


Outcome: TypeAlias = Restarted | Started[FrameT] | Measured[FrameT] | Skipped[FrameT]
"""What came of a frame."""


class FrameStream(Generic[_StampedT]):
    """
    Gives the frames of one camera to an estimator, in the order of their stamps.

    Late, stray and repeated frames are dropped (see ``StampGate``), those that the estimator
    refuses are skipped; both are counted in the estimator's counters. The node and the offline
    replay use the same class, so they use the same frames.
    """

    def __init__(self, estimator: TrajectoryEstimator) -> None:
        """Feed ``estimator``, which must not get frames from elsewhere."""
        self._estimator = estimator
        self._gate: StampGate[_StampedT] = StampGate()

    def push(self, frame: _StampedT) -> Iterator[Outcome[_StampedT]]:
        """
        Take the next frame; yield what came of it, and of a frame that was held before it.

        The iterator has to be exhausted before the next call. A held frame is not copied.
        """
        return self._take(self._gate.push(frame, frame.stamp_ns))

    def skip(self) -> None:
        """Count a frame that could not be read or decoded."""
        self._estimator.skip()

    def finish(self) -> Iterator[Outcome[_StampedT]]:
        """End the stream; yield what came of a frame that was held."""
        return self._take(self._gate.finish())

    def reset(self) -> None:
        """Start anew with the next frame, whatever its stamp."""
        self._gate = StampGate()
        self._estimator.reset()

    def _take(self, passing: Iterable[Passed[_StampedT]]) -> Iterator[Outcome[_StampedT]]:
        repeated, dropped = self._gate.repeated, self._gate.dropped
        # All of them first, as a frame may be the last that is taken from this iterator.
        passed = list(passing)
        self._estimator.repeat_stamp(self._gate.repeated - repeated)
        self._estimator.counters.dropped += self._gate.dropped - dropped
        for each in passed:
            yield from self._use(each)

    def _use(self, passed: Passed[_StampedT]) -> Iterator[Outcome[_StampedT]]:
        frame, estimator = passed.frame, self._estimator
        newest_ns = estimator.last_stamp_ns
        if passed.restarts and newest_ns is not None:
            yield Restarted(newest_ns, passed.stamp_ns)
            estimator.reset()
            estimator.counters.time_resets += 1
        try:
            update = estimator.update(frame.image, passed.stamp_ns, encoding=frame.encoding)
        except FrameError as error:
            estimator.skip()
            yield Skipped(frame, str(error))
            return
        yield Started(frame) if update is None else Measured(frame, update)
