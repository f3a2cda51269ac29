# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj demo``: plays a rendered drive to the real node and checks the result."""

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from phase_traj_ros.cli.commands.demo_drive import render, replay_bag
from phase_traj_ros.cli.commands.demo_map import run_on_map
from phase_traj_ros.cli.options import add_force, Command
from phase_traj_ros.cli.report import print_doubts, print_result, turn_words
from phase_traj_ros.core import Direction, PAPER_THRESHOLD
from phase_traj_ros.core.codes.text import describe
from phase_traj_ros.errors import MissingDependencyError, ResultError
from phase_traj_ros.io.messages.published import TEXT_RUNS
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.results.files import RESULT_NAMES, write_results
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Drive, DRIVES, named_drive

# The thresholds of the paper's two experiments.
_THRESHOLDS = {'paper_case_1': 16.0, 'paper_case_2': 20.0}

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
        '--drive', choices=sorted(DRIVES), default='demo',
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
        run_on_map(options)
        return
    try:
        from phase_traj_ros.ros.playback.live_run import run_live
    except ImportError as error:
        raise MissingDependencyError(
            f'the demo needs rclpy ({error}): source a ROS 2 installation, or install'
            ' phase_traj_ros[ros]') from None
    drive = named_drive(options.drive)
    parameters = Parameters(camera_height=drive.camera.above_ground)
    if options.paper:
        parameters = Parameters(threshold=_THRESHOLDS.get(drive.name, PAPER_THRESHOLD))
    name = f'{drive.name}_bag'
    with output_directory(
            options.output, names=(*RESULT_NAMES, name), force=options.force) as directory:
        render(drive, directory / name)
        print('playing them to the node over DDS ...', flush=True)
        online = run_live(directory / name, frames=len(drive), values=parameters)
        offline = replay_bag(directory / name, parameters, named=options.output / name)
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
