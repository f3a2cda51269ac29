# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands share: how each is described, and common options."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from textwrap import fill
from typing import Any

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import find_params_file, parse_assignment, read_parameters
from phase_traj_ros.io.sources.base import DEFAULT_SPEED_TOPIC, FrameSource
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import Selection
from phase_traj_ros.parameter_spec import Group
from phase_traj_ros.parameters import Parameters, specs
from phase_traj_ros.tasks.batch.job import ReplayRequest

# Parameters of the node, and what a replay has instead; a file with them may be for both.
_OF_NODE = {
    'image_transport': '--topic', 'output_dir': '--output', 'map_file': 'phase_traj locate --map'}

RCLPY_REMEDY = 'source a ROS 2 installation, or install phase_traj_ros[ros]'

SOURCE_HELP = """\
SOURCE is one of
  a ROS 2 bag       a directory with metadata.yaml, or a single .mcap or .db3 file
  a ROS 1 bag       a .bag file
  a video file      anything that PyAV or, where it is absent, OpenCV reads
  a folder          of images, in natural order of their names; with times.txt (seconds, one
                    per line) in it or beside it, as in a KITTI sequence, else see --fps
"""


def number(
    what: str, fits: Callable[[float], bool], kind: type[float] = float,
) -> Callable[[str], float]:
    """Return the type of an option: a number that ``fits``; ``what`` says which do."""
    def parse(text: str) -> float:
        with suppress(ValueError):
            value = kind(text)
            if fits(value):
                return value
        raise ArgumentTypeError(f'{text!r} does not fit: give {what}')
    return parse


@dataclass(frozen=True)
class Command:
    """
    A command of the program.

    Parameters
    ----------
    name
        Name that the user types.
    summary
        Purpose, as a sentence without capital and full stop.
    example
        A call that shows the most common use.
    epilog
        Text at the end of ``--help``; line breaks are kept.

    """

    name: str
    summary: str
    example: str
    epilog: str = ''

    def add_to(self, commands: Any) -> ArgumentParser:
        """Add the parser of this command to the subparsers; return it."""
        parser: ArgumentParser = commands.add_parser(
            # Without a help text, completion in the shell would leave the command out.
            self.name, help=self.summary,
            description=self.summary[0].upper() + self.summary[1:] + '.',
            epilog=f'example:\n  {self.example}\n{self.epilog.rstrip()}',
            formatter_class=RawDescriptionHelpFormatter)
        return parser


def add_source(parser: ArgumentParser, *, several: bool = False) -> None:
    """Add SOURCE, or several of them, and the options that select frames."""
    parser.add_argument(
        'sources' if several else 'source', metavar='SOURCE', type=Path,
        nargs='+' if several else None, help='source of the frames')
    parser.add_argument(
        '--topic', metavar='TOPIC', help='image topic of the bag, if it has several')
    parser.add_argument(
        '--start', metavar='S', type=float, default=0.0,
        help='start S seconds after the first frame (default 0)')
    parser.add_argument(
        '--duration', metavar='S', type=float, help='stop S seconds later (default: at the end)')
    parser.add_argument(
        '--every', metavar='N', type=int, default=1, help='use every N-th frame (default 1)')
    parser.add_argument(
        '--fps', metavar='F', type=float,
        help='frames per second of a folder or video; overrides its stamps (a folder'
             ' without times.txt: default 10)')


def add_force(parser: ArgumentParser) -> None:
    """Add the option that replaces files of someone else in an output folder."""
    parser.add_argument(
        '--force', action='store_true',
        help='replace files in DIR that no earlier run wrote (default: refuse)')


def selection_of(options: Namespace) -> Selection:
    """Return the selection of frames given by the options of ``add_source``."""
    return Selection(start=options.start, duration=options.duration, every=options.every)


def source_of(options: Namespace, source: Path) -> FrameSource:
    """Open a source with the options of ``add_source``."""
    return open_source(
        source, topic=options.topic, selection=selection_of(options), fps=options.fps)


def add_parameters(parser: ArgumentParser) -> None:
    """Add the options of a replay: parameters, and how they are used."""
    parser.add_argument(
        '--threshold', metavar='PX', type=float,
        help="shift in pixels per frame from which a pair is a turn, the paper's rule"
             ' (default: the value in --params, otherwise no threshold)')
    parser.add_argument(
        '--params', metavar='FILE', type=Path,
        help='ROS parameter file, as for the node: a path, or the name of one in config/, such as'
             ' vehicle.yaml')
    parser.add_argument(
        '-p', '--param', metavar='NAME:=VALUE', action='append', default=[],
        help='set one parameter; overrides --params; may be repeated')
    parser.add_argument(
        '--speed-topic', metavar='TOPIC',
        help='topic of a bag with the speed as TwistStamped, TwistWithCovarianceStamped or'
             f' Odometry; sets use_speed_topic (default, if that is set: {DEFAULT_SPEED_TOPIC})')
    parser.add_argument(
        '--one-pass', action='store_true',
        help='learn an unknown camera during the replay, as the node does (default: learn it'
             ' in a first pass)')


def parameters_help() -> str:
    """Return the help text of the parameters that a user or a vehicle may need."""
    lines = ['parameters for -p and --params (all: docs/reference/parameters.md):']
    for group in (Group.USER, Group.VEHICLE):
        lines.append(f'\n{group.value[0].lower()}{group.value[1:]}:')
        for spec in specs():
            if spec.group is group:
                lines.append(fill(
                    f'{spec.name} ({spec.default!r}): {spec.description}', 96,
                    initial_indent='  ', subsequent_indent='      '))
    return '\n'.join(lines) + '\n'


def request_of(
    options: Namespace, source: Path, *, also_read: tuple[Path, ...] = (),
) -> ReplayRequest:
    """Return the request to replay ``source``; options have the names of its fields."""
    names = {each.name for each in fields(ReplayRequest)}
    given = {name: value for name, value in vars(options).items()
             if name in names and value is not None}
    params = (find_params_file(options.params).absolute(),) if options.params else ()
    return ReplayRequest(**{
        **given, 'source': source, 'parameters': parameters_of(options),
        'selection': selection_of(options), 'also_read': (*also_read, *params)})


def parameters_of(options: Namespace) -> Parameters:
    """Return the parameters given by the options of ``add_parameters``."""
    parameters = Parameters()
    if options.params is not None:
        parameters = read_parameters(find_params_file(options.params))
    values = dict(map(parse_assignment, options.param))
    for name, instead in _OF_NODE.items():
        if name in values:
            raise ParameterError(f'{name} has an effect in the node only: use {instead}')
    if options.threshold is not None:
        values['threshold'] = options.threshold
    if options.speed_topic is not None:
        values['use_speed_topic'] = True
    return parameters.with_values(values)
