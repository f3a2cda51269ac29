# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj demo``: renders a drive, replays it, and finds it on a map."""

from argparse import Namespace
import math
from pathlib import Path
from typing import Any

from phase_traj_ros.cli.command import Command
from phase_traj_ros.cli.options import add_force
from phase_traj_ros.cli.progress import progress
from phase_traj_ros.cli.report import print_result
from phase_traj_ros.core import PAPER_THRESHOLD
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.replay.camera import known_lens
from phase_traj_ros.io.replay.run import Replay, replay
from phase_traj_ros.io.results.figures import require_matplotlib
from phase_traj_ros.io.results.files import RESULT_NAMES, write_results
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Drive, DRIVES, named_drive, town_drive, write_drive_bag
from phase_traj_ros.tasks.location.files import (
    add_to_chain_code,
    LOCATION_FILES,
    REPORT,
    write_location,
)
from phase_traj_ros.tasks.location.odometry import odometry_of
from phase_traj_ros.tasks.location.report import verdict, write_location_report
from phase_traj_ros.tasks.location.run import locate, Located, Near

# The thresholds of the paper's two experiments.
_THRESHOLDS = {'paper_case_1': 16.0, 'paper_case_2': 20.0}
# Where the town is said to be: in the sea, so that nobody takes it for a real one.
_ORIGIN = LocalProjection(54.5, 7.0)
# The drive is somewhere in the town: it is too short to prove that as well.
_TOWN = Near(54.5, 7.0, 2000.0)
_MAP = 'town.osm'

_EPILOG = """
Renders a drive through a street grid and replays it. DIR receives the bag, with the true poses,
and the results of the replay. To see the node at work, play the bag to it:

  phase_traj play out/demo/demo_bag

With --map, the drive goes through a town, and is located on the roads of the town, which are
written to DIR as town.osm.
"""

COMMAND = Command(
    'demo', summary='render a drive, replay it, and compare it with the true one',
    example='phase_traj demo --output out/demo', epilog=_EPILOG)


def add_parser(commands: Any) -> None:
    """Add the command to the parser."""
    parser = COMMAND.add_to(commands)
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
    parser.set_defaults(run=run)


def run(options: Namespace) -> None:
    """Run the command."""
    require_matplotlib()
    drive = town_drive() if options.map else named_drive(options.drive)
    parameters = Parameters(camera_height=drive.camera.above_ground)
    if options.paper:
        parameters = Parameters(threshold=_THRESHOLDS.get(drive.name, PAPER_THRESHOLD))
    name = f'{drive.name}_bag'
    names = (*RESULT_NAMES, name, *((*LOCATION_FILES, _MAP) if options.map else ()))
    located = None
    with output_directory(options.output, names=names, force=options.force) as directory:
        print(f'rendering {len(drive)} frames of the drive {drive.name!r} ...', flush=True)
        with progress(total=len(drive), title='rendering') as bar:
            write_drive_bag(drive, directory / name, progress=bar.update)
        with open_source(directory / name) as source:
            frames = progress(source, total=len(drive), title='replaying')
            result = replay(
                frames, parameters, source=str(options.output / name),
                lens=known_lens(source, parameters))
        write_results(result, directory)
        if options.map:
            located = _locate(drive, result, directory)
    print_result(result)
    turns = ', '.join(
        f'{"left" if turn.angle_deg > 0 else "right"} {abs(turn.angle_deg):.0f}'
        for turn in drive.turns)
    print(f'the true turns: {turns}')
    print(f'bag       {options.output / name}')
    print(f'codes     {options.output / "chain_code.json"}')
    print(f'picture   {options.output / "trajectory.png"}')
    if located is not None:
        print(f'{located.roads.length / 1e3:.1f} km of road. {verdict(located)}, at most'
              f' {distance_off(located, drive):.1f} m off')
        print(f'map       {options.output / _MAP}')
        print(f'report    {options.output / REPORT}')


def _locate(drive: Drive, result: Replay, directory: Path) -> Located:
    """Locate a replayed drive on the roads of its town, and write map and place."""
    write_osm(drive.build_roads(), directory / _MAP, projection=_ORIGIN)
    located = locate(odometry_of(result), read_roads(directory / _MAP), near=_TOWN)
    write_location(located, directory)
    write_location_report(located, directory / REPORT, title=drive.name)
    codes = directory / 'chain_code.json'
    add_to_chain_code(located, codes, codes)
    return located


def distance_off(located: Located, drive: Drive) -> float:
    """Return the largest distance of the known places from the true ones, in metres."""
    truth = dict(zip(drive.stamps_ns.tolist(), drive.poses[:, :2].tolist()))
    off = 0.0
    for pose in located.poses:
        if pose.claim is not None:
            place = located.roads.projection.to_degrees(pose.claim.x, pose.claim.y)
            x, y = _ORIGIN.to_metres(*place).tolist()
            off = max(off, math.dist((x, y), truth[pose.stamp_ns]))
    return off
