# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The base class of all sources of frames."""

from abc import abstractmethod
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass, replace
from typing import TypeAlias

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import FrameError, SourceError
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.messages.mounting import Mount
from phase_traj_ros.io.sources.selection import Selection, Selector

DEFAULT_FPS = 10.0
"""Frames per second, if neither the source nor the user gives a rate."""

DEFAULT_SPEED_TOPIC = '/speed'
"""Topic of a bag that holds speeds: the node's, if it runs in the root namespace."""

# Share of the declared frames.
_FEW_MISSING = 0.02

CAMERA_FRAME = 'camera'
"""Name of the camera's coordinate frame, if the source gives none."""


@dataclass(frozen=True, slots=True)
class StampedFrame:
    """
    A greyscale image, (H, W), uint8, uint16 or float32, and its time in nanoseconds.

    The image is read-only if it comes from a ``FrameSource``.
    """

    image: GreyImage
    stamp_ns: int
    encoding: str = ''
    """Original encoding of the image, if the source gives it."""
    frame_id: str = CAMERA_FRAME
    """Name of the camera's coordinate frame in ROS."""
    number: int | None = None
    """Number of the frame in its source, before the selection, from 0 on; None if not known."""


@dataclass(frozen=True, slots=True)
class UnreadableFrame:
    """A selected frame that could not be read or decoded."""

    number: int
    """Number of the frame in its source, before the selection, from 0 on."""
    stamp_ns: int
    reason: str


Entry: TypeAlias = StampedFrame | UnreadableFrame
"""A selected frame of a source, decoded or not."""


@dataclass(frozen=True, slots=True)
class SourceFrames:
    """How many frames a source has, before the selection; None where it is not known."""

    declared: int | None = None
    """As the source says: a bag's index, the header of a video, the pictures of a folder."""
    read: int | None = None
    """As read, decoded or not; None unless the source was read to its end."""

    @property
    def missing(self) -> int:
        """Return how many of the declared frames could not be read; 0 if they are very few."""
        if self.declared is None or self.read is None:
            return 0
        missing = self.declared - self.read
        # Some videos declare their duration only.
        return missing if missing > _FEW_MISSING * self.declared else 0

    @property
    def problem(self) -> str | None:
        """Return a sentence if the source is cut off, None if it is not."""
        if not self.missing:
            return None
        return (f'{self.declared} frames are declared, but only {self.read} could be read: the'
                ' recording is cut off or damaged, or a trimmed video')


@dataclass(frozen=True, slots=True)
class Speed:
    """The vehicle's speed at a time, in metres per second, negative in reverse."""

    stamp_ns: int
    speed: float


@dataclass(frozen=True, slots=True)
class Candidate:
    """A frame that is not decoded until it is selected."""

    number: int
    """Number of the frame in its source, from 0 on."""
    stamp_ns: int
    decode: Callable[[], GreyImage]
    encoding: str = ''
    frame_id: str = CAMERA_FRAME

    def frame(self) -> StampedFrame:
        """Decode the frame; raises FrameError or SourceError if it cannot be used."""
        image = self.decode()
        # A read-only image is not copied by the estimator.
        image.flags.writeable = False
        return StampedFrame(image, self.stamp_ns, self.encoding, self.frame_id, self.number)


class FrameSource(AbstractContextManager['FrameSource']):
    """
    Frames in order, from a bag, a video or a folder.

    Each iter() starts again from the first frame. An iterator opens its files in the thread that
    iterates, and releases them when it is exhausted or closed, so it can be passed as a whole to a
    background thread. Iterating raises SourceError if the source cannot be read, FrameError or
    SourceError at an image that cannot be used, and SourceError at the end if there was no frame.
    ``entries`` goes on after an image that cannot be used.
    """

    # Stamp of the first frame, for a source whose candidates need not begin with it.
    _first_ns: int | None = None

    def __init__(
        self, *, description: str, selection: Selection, frame_count: int | None,
        declared: int | None = None,
    ) -> None:
        self.description = description
        """Short description of the source for reports."""
        self._selection = selection
        self.frame_count = frame_count
        """
        Number of frames to expect, after selection; None if not known.

        It is an estimate for progress bars: videos and broken bags may hold more or fewer.
        """
        self.frames = SourceFrames(declared=declared)
        """How many frames the source has; complete once it was read to its end."""

    def camera(self, *, rectified: bool) -> CameraModel | None:
        """
        Return the camera model that the source holds; None if it holds none.

        Parameters
        ----------
        rectified
            Whether the images are rectified, if the source has calibrations for both cases.

        Raises
        ------
        SourceError
            The calibration cannot be read.
        CalibrationError
            The calibration cannot be used.

        """
        return None

    def mount(self, base_frame: str) -> Mount | None:
        """
        Return how the camera is mounted on the frame ``base_frame``; None if that is unknown.

        Raises
        ------
        SourceError
            The transforms cannot be read.

        """
        return None

    def speeds(self, topic: str) -> Iterator[Speed]:
        """
        Yield the vehicle's speeds on a topic of a bag, in order.

        Raises
        ------
        SourceError
            The source is not a bag, the topic does not exist, or it cannot be read.

        """
        raise SourceError(
            f'{self.description} is not a bag and has no speeds: give the parameter speed')

    def __exit__(self, *_: object) -> None:
        """Nothing to release: the files are open during an iteration only."""

    def __iter__(self) -> Iterator[StampedFrame]:
        """Yield the selected frames."""
        with closing(self._selected()) as selected:
            for candidate in selected:
                yield candidate.frame()

    def entries(self) -> Generator[Entry, None, None]:
        """
        Yield the selected frames, also those that cannot be read or decoded.

        Raises SourceError if the source cannot be read, and at the end if there was no frame.
        """
        with closing(self._selected()) as selected:
            for candidate in selected:
                entry: Entry
                try:
                    entry = candidate.frame()
                except (FrameError, SourceError) as error:
                    entry = UnreadableFrame(candidate.number, candidate.stamp_ns, str(error))
                yield entry

    def _selected(self) -> Generator[Candidate, None, None]:
        """Yield the selected candidates."""
        selector = Selector(self._selection, self._first_ns)
        with closing(self._candidates()) as candidates:
            number = -1
            for candidate in candidates:
                number = candidate.number
                if selector.judge(candidate.stamp_ns):
                    yield candidate
                elif selector.over:
                    break
            else:
                self.frames = replace(self.frames, read=number + 1)
        if not selector.inside:
            if number < 0:
                raise SourceError(f'{self.description}: no frame could be read')
            start, duration = self._selection.start, self._selection.duration
            length = '' if duration is None else f', duration {duration:g} s'
            raise SourceError(
                f'{self.description}: no frame is selected (start {start:g} s{length}); the'
                f' last frame read is {selector.span_ns / 1e9:.3f} s after the first')

    @abstractmethod
    def _candidates(self) -> Generator[Candidate, None, None]:
        """Yield all frames in order, at least from the start of the selection on."""


def index_stamp_ns(index: int, fps: float) -> int:
    """Return the stamp in nanoseconds of the frame with that index, at a constant rate."""
    return round(index * 1_000_000_000 / fps)
