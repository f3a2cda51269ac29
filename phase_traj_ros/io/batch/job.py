# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Replays one source and writes the requested results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing, ExitStack
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Final

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.outputs import Outputs
from phase_traj_ros.io.replay.camera import known_lens, learned_lens
from phase_traj_ros.io.replay.kept import KeptFrames
from phase_traj_ros.io.replay.run import Replay, replay, Watcher
from phase_traj_ros.io.results.animation import Animation
from phase_traj_ros.io.results.bag import BagSink, SUFFIX
from phase_traj_ros.io.results.figures import (
    require_matplotlib,
    write_trajectory_picture,
    write_turn_picture,
)
from phase_traj_ros.io.results.files import RESULT_NAMES, write_results
from phase_traj_ros.io.results.report.report import write_report
from phase_traj_ros.io.results.thumbnails import (
    HeadingTurnWatcher,
    LeftOutPicture,
    Thumbnails,
    TurnWatcher,
)
from phase_traj_ros.io.sources.base import DEFAULT_SPEED_TOPIC, Entry, FrameSource
from phase_traj_ros.parameters import Parameters

REPORT: Final = 'report.html'


class Pass(Enum):
    """Pass over the frames of a source; the value is its name in progress bars."""

    ONLY = ''
    FIRST = 'pass 1 of 2: learning the camera'
    SECOND = 'pass 2 of 2'


Through = Callable[[Iterable[Entry], Pass], Iterable[Entry]]
"""Takes the frames of a pass and yields them, as a progress bar does."""


def _straight(frames: Iterable[Entry], _: Pass) -> Iterable[Entry]:
    return frames


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """
    The results to write, and where.

    Raises
    ------
    ParameterError
        The choices contradict each other.

    """

    output: Path | None = None
    """Folder of the codes, shifts, trajectory and pictures."""
    svg: bool = False
    """Whether the pictures are also written as SVG."""
    report: bool = False
    """Whether report.html is written."""
    bag_out: Path | None = None
    """Bag with all messages that the node would publish."""
    bag_debug_images: bool = False
    """Whether the bag contains the debug images."""
    animation: Path | None = None
    """File of the animated GIF."""
    force: bool = False
    """Whether files in the output folder are replaced that no earlier run wrote."""
    inputs: tuple[Path, ...] = ()
    """What is read: an output that is one of these or lies in one is refused."""
    batch: str = ''
    """Name of the batch of which this replay is a part."""

    def __post_init__(self) -> None:
        """Check the combination of the choices."""
        for name, chosen in (('report', self.report), ('svg', self.svg)):
            if chosen and self.output is None:
                raise ParameterError(f'{name} writes into the output folder: give output')
        if self.bag_debug_images and self.bag_out is None:
            raise ParameterError('bag_debug_images needs a bag to write them to: give bag_out')
        for name, path, suffix in (
                ('bag_out', self.bag_out, SUFFIX), ('animation', self.animation, '.gif')):
            if path is not None and path.suffix != suffix:
                raise ParameterError(f'{name} is {path}: its name has to end in {suffix}')

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the files that may be written into the output folder."""
        return (
            *RESULT_NAMES, 'turns.png',
            *(('trajectory.svg', 'turns.svg') if self.svg else ()),
            *((REPORT,) if self.report else ()))


def replay_source(
    source: FrameSource, parameters: Parameters, wanted: Wanted, *, title: str,
    watchers: Sequence[Watcher] = (),
    through: Through = _straight,
    speed_topic: str = DEFAULT_SPEED_TOPIC, one_pass: bool = False, strict: bool = False,
) -> Replay:
    """
    Replay a source and write the results, all of them or none.

    ``title`` is the name of the source in the report. ``watchers`` receive the frames and their
    results in the last pass. ``speed_topic`` is the bag's topic of speeds, used if the parameters
    ask for it.

    An unknown camera is learned in a first pass over all frames. With ``one_pass`` it is learned
    during the replay instead, as in the node. With ``strict``, a frame that cannot be used is an
    error.

    Raises
    ------
    SourceError
        The source cannot be read, or has fewer than two frames to use.
    FrameError
        A frame cannot be used.
    ParameterError
        The parameters do not fit the source.
    CalibrationError
        The calibration in the source cannot be used.
    OutputError
        A result cannot be written, or would replace an input or a file of someone else.
    MissingDependencyError
        A package is missing that the source or a result needs.

    """
    with ExitStack() as stack:
        owner = stack.enter_context(Outputs(
            inputs=wanted.inputs, force=wanted.force, batch=wanted.batch))
        outputs: list[_Folder | _Gif] = []
        if wanted.output is not None:
            require_matplotlib()
            outputs.append(_Folder(
                owner.directory(wanted.output, names=wanted.names), wanted.output, wanted, title,
                parameters))
        if wanted.animation is not None:
            outputs.append(_Gif(owner.file(wanted.animation), wanted.animation, Animation()))
        seen = [*watchers, *(watcher for output in outputs for watcher in output.watchers)]
        if wanted.bag_out is not None:
            stack.enter_context(writing_to(wanted.bag_out))
            seen.append(stack.enter_context(BagSink(
                owner.file(wanted.bag_out), parameters, source=source.description,
                debug_images=wanted.bag_debug_images)))
        frames = KeptFrames(source)
        lens = known_lens(source, parameters)
        last = Pass.ONLY
        if lens is None and not one_pass and parameters.learns_camera:
            last = Pass.SECOND
            with closing(frames.keeping()) as first:
                lens = learned_lens(
                    through(first, Pass.FIRST), parameters, source.description, strict=strict)
        speeds = source.speeds(speed_topic) if parameters.use_speed_topic else ()
        with closing(frames.once()) as again:
            result = replay(
                through(again, last), parameters, source=source.description, watchers=seen,
                lens=lens, speeds=speeds, strict=strict)
        result = replace(result, source_frames=source.frames)
        for output in outputs:
            with writing_to(output.target):
                output.write(result)
    return result


class _Folder:
    """The results in the folder of --output."""

    def __init__(
        self, staging: Path, target: Path, wanted: Wanted, title: str, parameters: Parameters,
    ) -> None:
        self.target = target
        self._staging = staging
        self._wanted = wanted
        self._title = title
        self._turns = HeadingTurnWatcher() if parameters.codes_from_heading else TurnWatcher()
        self._thumbnails = Thumbnails()
        self._left_out = LeftOutPicture()

    @property
    def watchers(self) -> tuple[Watcher, ...]:
        if not self._wanted.report:
            return (self._turns,)
        return self._turns, self._thumbnails, self._left_out

    def write(self, result: Replay) -> None:
        write_results(result, self._staging)
        if self._wanted.svg:
            write_trajectory_picture(result, self._staging / 'trajectory.svg')
        if self._turns.turns:
            for kind in ('png', 'svg') if self._wanted.svg else ('png',):
                write_turn_picture(self._turns.turns, result, self._staging / f'turns.{kind}')
        if self._wanted.report:
            write_report(
                result, self._staging / REPORT, title=self._title,
                picture=self._staging / 'trajectory.png', thumbnails=self._thumbnails.kept,
                left_out=self._left_out.jpeg)


class _Gif:
    """The animated GIF of --animation."""

    def __init__(self, staged: Path, target: Path, animation: Animation) -> None:
        self.target = target
        self._staged = staged
        self._animation = animation

    @property
    def watchers(self) -> tuple[Watcher, ...]:
        return (self._animation,)

    def write(self, result: Replay) -> None:
        self._animation.write(result, self._staged)
