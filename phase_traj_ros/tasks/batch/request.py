# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The request for a replay: what to read, how to code it, and what to write."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
import os
from pathlib import Path

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.outputs.outputs import check_directory
from phase_traj_ros.io.results.bag import SUFFIX
from phase_traj_ros.io.results.files import RESULT_NAMES
from phase_traj_ros.io.sources.base import DEFAULT_SPEED_TOPIC, FrameSource
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.parameters import Parameters

REPORT = 'report.html'

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
