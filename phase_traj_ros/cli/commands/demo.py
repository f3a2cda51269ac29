# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj demo``: plays a rendered drive to the real node, or finds it on a map."""

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from dataclasses import replace
import math
from pathlib import Path

from phase_traj_ros.cli.ending import say
from phase_traj_ros.cli.options import add_force, Command, RCLPY_REMEDY
from phase_traj_ros.cli.report import print_doubts, print_result, progress, turn_words
from phase_traj_ros.core import Direction, PAPER_THRESHOLD
from phase_traj_ros.core.codes.text import describe
from phase_traj_ros.errors import needing, ParameterError, ResultError
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
from phase_traj_ros.io.messages.published import TEXT_RUNS
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.replay.camera import known_lens
from phase_traj_ros.io.replay.run import Replay, replay
from phase_traj_ros.io.results.files import RESULT_NAMES, write_results
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Drive, DRIVES, named_drive, town_drive, write_drive_bag
from phase_traj_ros.tasks.location.files import CODES, LOCATION_FILES, write_location
from phase_traj_ros.tasks.location.odometry import odometry_of
from phase_traj_ros.tasks.location.report import verdict
from phase_traj_ros.tasks.location.run import locate, Located, Near

# The thresholds of the paper's two experiments.
_THRESHOLDS = {'paper_case_1': 16.0, 'paper_case_2': 20.0}
# Where the town is said to be: in the sea, so that nobody takes it for a real one.
_ORIGIN = LocalProjection(54.5, 7.0)
# The drive is somewhere in the town: it is too short to prove that as well.
_TOWN = Near(54.5, 7.0, 2000.0)
_MAP = 'town.osm'
_DRIVE = 'demo'
# Largest distance from the true place, in metres.
_WRONG = 15.0

_EPILOG = """
Renders a drive through a street grid, plays it over DDS without losing a frame to the node in a
separate process, and records what the node publishes. Checks that against an offline replay of
the same bag and against the true turns. DIR receives the bag (with the true poses) and the results
of the replay.

With --map, the drive goes through a town, is replayed offline, and is located on the roads of the
town, which are written to DIR as town.osm.
"""

COMMAND = Command(
    'demo', summary='render a drive and play it through the real node',
    example='phase_traj demo --output out/demo', epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    parser.add_argument(
        '--drive', choices=sorted(DRIVES), default=_DRIVE,
        help="drive: demo, or one of the paper's two case studies (default: demo)")
    parser.add_argument(
        '--paper', action='store_true',
        help="use the paper's rule: the shift and a threshold, instead of the turns")
    parser.add_argument(
        '--map', action='store_true',
        help='drive through a town, and find the drive on its map')
    parser.add_argument(
        '--output', metavar='DIR', type=Path, default=Path('out/demo'),
        help='write the results here (default: out/demo)')
    add_force(parser)


def run(options: Namespace) -> None:
    """Run the command."""
    if options.map:
        if options.paper or options.drive != _DRIVE:
            raise ParameterError('--map has a drive and settings of its own: leave out --drive and'
                                 ' --paper')
        _run_on_map(options)
        return
    with needing('the demo needs rclpy', RCLPY_REMEDY):
        from phase_traj_ros.ros.playback.live_run import run_live
    drive = named_drive(options.drive)
    parameters = Parameters(camera_height=drive.camera.above_ground)
    if options.paper:
        parameters = Parameters(threshold=_THRESHOLDS.get(drive.name, PAPER_THRESHOLD))
    name = f'{drive.name}_bag'
    with output_directory(
            options.output, names=(*RESULT_NAMES, name), force=options.force) as directory:
        _render(drive, directory / name)
        say('playing them to the node over DDS ...')
        online = run_live(directory / name, frames=len(drive), values=parameters)
        offline = _replay_bag(directory / name, parameters, named=options.output / name)
        text = describe(offline.codes, frames=offline.frames, max_runs=TEXT_RUNS)
        if online != str(text):
            raise ResultError('the codes of the node and of the offline replay differ')
        check_turns(drive, offline)
        write_results(offline, directory)
    print_result(offline)
    print_doubts(offline)
    turns = ', '.join(f'{turn_words(turn.angle_deg)}°' for turn in drive.turns)
    print(f'live and offline codes are the same, and the turns are the true ones: {turns}')
    print(f'bag       {options.output / name}')
    print(f'codes     {options.output / "chain_code.json"}')
    print(f'picture   {options.output / "trajectory.png"}')


def check_turns(drive: Drive, result: Replay) -> None:
    """
    Compare the directions, and when they changed, with the true turns.

    Raises
    ------
    ResultError
        A turn is missing, invented, or coded while the vehicle was not turning.

    """
    heading = Direction.FORWARD
    expected = [heading]
    for turn in drive.turns:
        heading = heading.turned_left() if turn.angle_deg > 0 else heading.turned_right()
        expected.append(heading)
    found = [run.code for run in result.codes.direction.runs]
    if found != expected:
        raise ResultError(f'directions {_text(found)}, but {_text(expected)} were driven')
    begun = [
        update.pair + 1 for update in result.updates
        if update.step.appended and update.step.movement != 1]
    for frame, turn in zip(begun, drive.turns, strict=True):
        if not turn.start_frame <= frame <= turn.end_frame:
            raise ResultError(
                f'a turn is coded at frame {frame}, but the true one lasts from'
                f' {turn.start_frame} to {turn.end_frame}')


def _text(directions: Sequence[int]) -> str:
    return ','.join(str(int(direction)) for direction in directions)


def _run_on_map(options: Namespace) -> None:
    """
    Render a drive, write the roads of its town, and locate the drive on them.

    Raises
    ------
    ResultError
        The place is not known at the end, or it is wrong.

    """
    drive = town_drive()
    name = f'{drive.name}_bag'
    parameters = Parameters(camera_height=drive.camera.above_ground)
    names = (*RESULT_NAMES, *LOCATION_FILES, name, _MAP)
    with output_directory(options.output, names=names, force=options.force) as directory:
        _render(drive, directory / name)
        write_osm(drive.build_roads(), directory / _MAP, projection=_ORIGIN)
        roads = replace(read_roads(directory / _MAP), source=str(options.output / _MAP))
        result = _replay_bag(directory / name, parameters, named=options.output / name)
        write_results(result, directory)
        located = locate(odometry_of(result), roads, near=_TOWN)
        off = distance_off(located, drive)
        write_location(located, directory, title=drive.name, codes=directory / CODES)
    print(f'{roads.length / 1e3:.1f} km of road. {verdict(located)}, at most {off:.1f} m off')
    print(f'map       {options.output / _MAP}')
    print(f'report    {options.output / "location.html"}')


def distance_off(located: Located, drive: Drive) -> float:
    """
    Return the largest distance in metres of the known places from the true ones.

    Raises
    ------
    ResultError
        The place is not known at the end, or one is wrong.

    """
    if not located.poses[-1].estimate.claimed:
        raise ResultError(f'{verdict(located)} at the end of the drive')
    truth = dict(zip(drive.stamps_ns.tolist(), drive.poses[:, :2].tolist()))
    off = 0.0
    for pose in located.poses:
        if pose.estimate.claimed:
            x, y = _ORIGIN.to_metres(*located.degrees(pose.estimate)).tolist()
            off = max(off, math.dist((x, y), truth[pose.stamp_ns]))
    if not off < _WRONG:
        raise ResultError(f'a place is {off:.1f} m from the true one')
    return off


def _render(drive: Drive, bag: Path) -> None:
    """Render a drive to a bag."""
    say(f'rendering {len(drive)} frames of the drive {drive.name!r} ...')
    with progress(total=len(drive), title='rendering') as bar:
        write_drive_bag(drive, bag, progress=bar.update)


def _replay_bag(bag: Path, parameters: Parameters, *, named: Path) -> Replay:
    """Replay a rendered drive in one pass; ``named`` is the place that the bag will have."""
    with open_source(bag) as source:
        shown = progress(source, total=source.frame_count, title='replaying')
        return replay(shown, parameters, source=str(named), lens=known_lens(source, parameters)[0])
