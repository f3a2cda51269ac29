# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What every source of frames has, whatever it reads."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from types import TracebackType
from typing import Final, TypeVar

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.sources.selection import Choice, Selection, Selector

DEFAULT_FPS: Final = 10.0
"""Frames per second where neither the source nor the user says."""

DEFAULT_SPEED_TOPIC: Final = '/speed'
"""Topic of a bag that speeds are taken from: that of a node in the root namespace."""

CAMERA_FRAME: Final = 'camera'
"""Name of the camera's frame where the source gives none."""

_SourceT = TypeVar('_SourceT', bound='FrameSource')


@dataclass(frozen=True, slots=True)
class StampedFrame:
    """A grey image, (H, W), uint8 or uint16, and the time it was taken at, in nanoseconds."""

    image: GreyImage
    stamp_ns: int
    encoding: str = ''
    """What the image was made from, where the source says so."""
    frame_id: str = CAMERA_FRAME
    """Name of the camera's frame in ROS."""


@dataclass(frozen=True, slots=True)
class Speed:
    """The vehicle's speed at a time, in metres per second, negative in reverse."""

    stamp_ns: int
    speed: float


@dataclass(frozen=True, slots=True)
class Candidate:
    """A frame that is not decoded yet: it may turn out not to be selected."""

    stamp_ns: int
    decode: Callable[[], GreyImage]
    encoding: str = ''
    frame_id: str = CAMERA_FRAME


class FrameSource(ABC):
    """
    Frames in order, from a bag, a video or a folder.

    Each iter() starts anew from the first frame. An iterator opens what it reads in the thread
    that iterates, and releases it when it is exhausted or closed, so it can be handed to a
    background thread as a whole. Iterating raises SourceError where the source cannot be read,
    FrameError at an image that cannot be used, and SourceError at the end if there was no frame
    to be had.
    """

    def __init__(
        self, *, description: str, selection: Selection, frame_count: int | None,
    ) -> None:
        self._description = description
        self._selection = selection
        self._frame_count = frame_count
        self._closed = False

    @property
    def description(self) -> str:
        """Say what is read, in a few words, for reports."""
        return self._description

    @property
    def frame_count(self) -> int | None:
        """
        Return the number of frames to expect, after selection; None if not known.

        It is meant for a progress bar: videos and broken bags may hold more or fewer.
        """
        return self._frame_count

    def camera(self, *, rectified: bool) -> CameraModel | None:
        """
        Return what the source knows of the camera; None if it knows nothing.

        Parameters
        ----------
        rectified
            Whether the images are rectified ones, where the source has calibrations for both.

        Raises
        ------
        SourceError
            It should know something, but that cannot be read.
        CalibrationError
            What it knows cannot be used.

        """
        return None

    def speeds(self, topic: str) -> Iterator[Speed]:
        """
        Yield the vehicle's speeds that come on a topic of a bag, in order.

        Raises
        ------
        SourceError
            It is no bag, or there is no such topic, or it cannot be read.

        """
        raise SourceError(
            f'{self._description} is no bag, so no speed comes with it: give the parameter speed')

    def __enter__(self: _SourceT) -> _SourceT:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release what the source holds; it cannot be iterated over any more."""
        self._closed = True

    def __iter__(self) -> Iterator[StampedFrame]:
        if self._closed:
            raise SourceError(f'{self._description} is closed already')
        return self._selected()

    def _selected(self) -> Generator[StampedFrame, None, None]:
        selector = Selector(self._selection)
        with closing(self._candidates()) as candidates:
            for candidate in candidates:
                choice = selector.judge(candidate.stamp_ns)
                if choice is Choice.STOP:
                    break
                if choice is Choice.USE:
                    yield StampedFrame(
                        candidate.decode(), candidate.stamp_ns, candidate.encoding,
                        candidate.frame_id)
        if not selector.used:
            if not selector.seen:
                raise SourceError(f'{self._description}: no frame could be read')
            start, duration = self._selection.start, self._selection.duration
            length = '' if duration is None else f', duration {duration:g} s'
            raise SourceError(
                f'{self._description}: no frame is selected (start {start:g} s{length}); the '
                f'{selector.seen} frames read last {selector.span_ns / 1e9:.3f} s')

    @abstractmethod
    def _candidates(self) -> Generator[Candidate, None, None]:
        """Yield all frames from the first one on, before selection."""


def index_stamp_ns(index: int, fps: float) -> int:
    """Return the stamp, in nanoseconds, of the frame of that index at a constant rate."""
    return round(index * 1_000_000_000 / fps)


def selected_count(stamps_ns: list[int], selection: Selection) -> int:
    """Return how many frames of the given stamps are selected."""
    selector = Selector(selection)
    for stamp_ns in stamps_ns:
        if selector.judge(stamp_ns) is Choice.STOP:
            break
    return selector.used
