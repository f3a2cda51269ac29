# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Replays one source and writes the requested results."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing, ExitStack
import ctypes
from dataclasses import replace

from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.outputs import Outputs
from phase_traj_ros.io.replay.camera import known_lens, learned_lens, mounting_of
from phase_traj_ros.io.replay.run import Replay, replay, Watcher
from phase_traj_ros.io.results.bag import BagSink
from phase_traj_ros.io.results.figures import write_trajectory_picture
from phase_traj_ros.io.results.files import write_results
from phase_traj_ros.io.results.pictures import LeftOutPicture, Thumbnails
from phase_traj_ros.io.results.report.report import write_report
from phase_traj_ros.io.sources.base import Entry, FrameSource
from phase_traj_ros.io.sources.prefetch import prefetch
from phase_traj_ros.tasks.batch.request import ReplayRequest, REPORT


Through = Callable[[Iterable[Entry], str], Iterable[Entry]]
"""
Takes the frames of a pass and yields them, as a progress bar does.

The text is the name of the pass, empty if it is the only one.
"""


def replay_source(
    source: FrameSource, request: ReplayRequest, *, watchers: Sequence[Watcher] = (),
    through: Through = lambda frames, _: frames,
) -> Replay:
    """
    Replay a source as requested and write the results, all of them or none.

    ``source`` is the opened source of the request. ``watchers`` receive the frames and their
    results in the last pass.

    An unknown camera is learned in a first pass, unless ``one_pass`` is requested.

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
    mounting = mounting_of(source, request.parameters)
    parameters = mounting.parameters
    with ExitStack() as stack:
        owner = stack.enter_context(Outputs(inputs=request.inputs, force=request.force))
        seen = [*watchers]
        thumbnails, left_out = Thumbnails(), LeftOutPicture()
        if request.output is not None:
            folder = owner.directory(request.output, names=request.names)
        if request.report:
            seen += [thumbnails, left_out]
        if request.bag_out is not None:
            stack.enter_context(writing_to(request.bag_out))
            seen.append(stack.enter_context(BagSink(
                owner.file(request.bag_out), mounting, source=source.description,
                debug_images=request.bag_debug_images)))
        lens, unused_calibration = known_lens(source, parameters)
        last = ''
        if lens is None and not request.one_pass and parameters.settings.learns_lens:
            last = 'pass 2 of 2'
            with closing(prefetch(source.entries())) as frames:
                lens = learned_lens(
                    through(frames, 'pass 1 of 2: learning the camera'), parameters,
                    source.description, strict=request.strict)
        speeds = source.speeds(request.speed_topic) if parameters.use_speed_topic else ()
        with closing(prefetch(source.entries())) as frames:
            result = replay(
                through(frames, last), parameters, source=source.description, watchers=seen,
                lens=lens, speeds=speeds, strict=request.strict)
        result = replace(
            result, source_frames=source.frames, unused_calibration=unused_calibration,
            mounting=mounting)
        if request.output is not None:
            _give_memory_back()
            with writing_to(request.output):
                write_results(result, folder)
                if request.svg:
                    write_trajectory_picture(result, folder / 'trajectory.svg')
                if request.report:
                    write_report(
                        result, folder / REPORT, title=request.title,
                        picture=folder / 'trajectory.png', thumbnails=thumbnails.kept,
                        left_out=left_out.jpeg)
    return result


def _give_memory_back() -> None:
    """Return the memory of the frames to the system before pictures are drawn, under glibc."""
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
