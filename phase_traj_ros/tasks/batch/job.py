# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The replay of one source: what to read, how to code it, and what to write, and its run."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing, ExitStack
import ctypes
from dataclasses import dataclass, field, replace
import os
from pathlib import Path

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.outputs import check_directory, Outputs
from phase_traj_ros.io.replay.camera import known_lens, learned_lens, mounting_of
from phase_traj_ros.io.replay.run import Replay, replay, Watcher
from phase_traj_ros.io.results.bag import BagSink, SUFFIX
from phase_traj_ros.io.results.figures import write_trajectory_picture
from phase_traj_ros.io.results.files import RESULT_NAMES, write_results
from phase_traj_ros.io.results.pictures import LeftOutPicture, Thumbnails
from phase_traj_ros.io.results.report.report import write_report
from phase_traj_ros.io.sources.base import DEFAULT_SPEED_TOPIC, Entry, FrameSource
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.prefetch import prefetch
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.parameters import Parameters

REPORT = 'report.html'

Through = Callable[[Iterable[Entry], str], Iterable[Entry]]
"""
Takes the frames of a pass and yields them, as a progress bar does.

The text is the name of the pass, empty if it is the only one.
"""

_LONGEST_NAME = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayRequest:
    """
    A replay of one source. It can be sent to another process or machine.

    Raises
    ------
    ParameterError
        The choices contradict each other.

    """

    source: Path
    parameters: Parameters = field(default_factory=Parameters)
    topic: str | None = None
    """Image topic of a bag that has several."""
    speed_topic: str = DEFAULT_SPEED_TOPIC
    """Topic of speeds of a bag, used if the parameters ask for it."""
    selection: Selection = EVERYTHING
    fps: float | None = None
    """Frames per second of a folder or video, instead of its stamps."""
    one_pass: bool = False
    """Whether an unknown camera is learned during the replay, as in the node."""
    strict: bool = False
    """Whether a frame that cannot be used is an error; otherwise it is skipped and counted."""
    output: Path | None = None
    """Folder of the codes, shifts, trajectory and pictures."""
    svg: bool = False
    """Whether the picture is also written as SVG."""
    report: bool = False
    """Whether report.html is written."""
    bag_out: Path | None = None
    """Bag with all messages that the node would publish."""
    bag_debug_images: bool = False
    """Whether the bag contains the debug images."""
    force: bool = False
    """Whether files in the output folder are replaced that no earlier run wrote."""
    also_read: tuple[Path, ...] = ()
    """What is read besides the source, such as the parameter file."""

    def __post_init__(self) -> None:
        """Check the combination of the choices."""
        for name, chosen in (('report', self.report), ('svg', self.svg)):
            if chosen and self.output is None:
                raise ParameterError(f'{name} writes into the output folder: give output')
        if self.bag_debug_images and self.bag_out is None:
            raise ParameterError('bag_debug_images needs a bag to write them to: give bag_out')
        if self.bag_out is not None and self.bag_out.suffix != SUFFIX:
            raise ParameterError(f'bag_out is {self.bag_out}: its name has to end in {SUFFIX}')

    @property
    def title(self) -> str:
        """Return the name of the source for reports and progress bars."""
        return self.source.name or str(self.source)

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Return all that is read: an output that is one of these or lies in one is refused."""
        mask = self.parameters.mask_file
        return (self.source, *self.also_read, *((user_path(mask),) if mask else ()))

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the files that may be written into the output folder."""
        return (
            *RESULT_NAMES, *(('trajectory.svg',) if self.svg else ()),
            *((REPORT,) if self.report else ()))

    def opened(self) -> FrameSource:
        """Open the source; see ``open_source``."""
        return open_source(self.source, topic=self.topic, selection=self.selection, fps=self.fps)


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
        # Read before the frames, so that a wrong topic is refused at once.
        speeds = list(source.speeds(request.speed_topic)) if parameters.use_speed_topic else []
        lens, unused_calibration = known_lens(source, parameters)
        last = ''
        if lens is None and not request.one_pass and parameters.settings.learns_lens:
            last = 'pass 2 of 2'
            with closing(prefetch(source.entries())) as frames:
                lens = learned_lens(
                    through(frames, 'pass 1 of 2: learning the camera'), parameters,
                    source.description, strict=request.strict)
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


def batch_of(
    request: ReplayRequest, sources: Sequence[Path], root: Path, *, taken: Sequence[str] = (),
) -> tuple[ReplayRequest, ...]:
    """
    Return one request for each source, with a folder of its own in ``root``.

    Parameters
    ----------
    request
        What to do with each source. Its ``bag_out`` is a name without a folder.
    sources
        The sources.
    root
        The output folder.
    taken
        Names in it that no source may have.

    Raises
    ------
    ParameterError
        The name of the bag has a folder.
    OutputError
        An output folder is an input or lies in one, or contains files of someone else.

    """
    bag = request.bag_out
    if bag is not None and bag.name != str(bag):
        raise ParameterError(
            f'bag_out is {bag}: with several sources, give a name without a folder; each source'
            ' writes it to its own folder')
    read = tuple(path.absolute() for path in (*sources, *request.also_read))
    requests = []
    for source, folder in zip(sources, folder_names(sources, taken=taken), strict=True):
        output = root / folder
        each = replace(
            request, source=source, output=output, also_read=read,
            bag_out=None if bag is None else output / bag.name)
        check_directory(output, names=each.names, inputs=each.inputs, force=each.force)
        requests.append(each)
    return tuple(requests)


def folder_names(sources: Iterable[Path], *, taken: Sequence[str] = ()) -> list[str]:
    """
    Return a unique folder name for each source, unique also if case is ignored.

    It is the name of the source. Equal names are prefixed with the name of the parent folder,
    and numbered if they are still equal.
    """
    # With a name also for '.' and '..'.
    places = [Path(os.path.abspath(source)) for source in sources]
    stems = [_clean(place.name if place.is_dir() else place.stem) for place in places]
    often = Counter(stem.lower() for stem in stems)
    used = {name.lower() for name in taken}
    names = []
    for place, stem in zip(places, stems):
        if often[stem.lower()] > 1:
            stem = f'{_clean(place.parent.name)}-{stem}'
        name, number = stem, 1
        while name.lower() in used:
            number += 1
            name = f'{stem}-{number}'
        used.add(name.lower())
        names.append(name)
    return names


def _clean(name: str) -> str:
    kept = ''.join(sign if sign.isprintable() else '_' for sign in name)
    return kept.strip('. ').lstrip('=+-@')[:_LONGEST_NAME] or 'source'
