# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj demo --map``: a rendered drive is found on the map of its town."""

from argparse import Namespace
import math

from phase_traj_ros.cli.commands.demo_drive import render, replay_bag
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.results.files import RESULT_NAMES, write_results
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Drive, town_drive
from phase_traj_ros.tasks.location.files import CODES, LOCATION_FILES, write_location
from phase_traj_ros.tasks.location.odometry import odometry_of
from phase_traj_ros.tasks.location.report import verdict
from phase_traj_ros.tasks.location.run import locate, Located, Near

# Where the town is said to be: in the sea, so that nobody takes it for a real one.
_ORIGIN = LocalProjection(54.5, 7.0)
# The drive is somewhere in the town: it is too short to prove that as well.
_TOWN = Near(54.5, 7.0, 2000.0)
_MAP = 'town.osm'
# Largest distance from the true place, in metres.
_WRONG = 15.0


def run_on_map(options: Namespace) -> None:
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
        render(drive, directory / name)
        write_osm(drive.build_roads(), directory / _MAP, projection=_ORIGIN)
        roads = read_roads(directory / _MAP)
        result = replay_bag(directory / name, parameters, named=options.output / name)
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
