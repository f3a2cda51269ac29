# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj locate``: finds where on a road map a drive was."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from contextlib import ExitStack
from pathlib import Path

from phase_traj_ros.cli.options import (
    add_force,
    add_parameters,
    add_source,
    Command,
    number,
    request_of,
    SOURCE_HELP,
)
from phase_traj_ros.cli.report import over_passes, print_camera, print_doubts, progress
from phase_traj_ros.core.localization.given import ScaleRange
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.maps.projection import bearing_deg
from phase_traj_ros.io.maps.road_classes import Roads
from phase_traj_ros.io.maps.road_file import ATTRIBUTION, read_roads
from phase_traj_ros.io.outputs.outputs import check_directory, output_directory
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.tasks.batch.job import replay_source
from phase_traj_ros.tasks.location.files import CODES, LOCATION_FILES, REPORT, write_location
from phase_traj_ros.tasks.location.odometry import DriveOdometry, odometry_of, read_odometry
from phase_traj_ros.tasks.location.report import verdict
from phase_traj_ros.tasks.location.run import locate, Located, Near

EXIT_NOT_KNOWN = 1

# Metres that a drive takes to be located, mostly: anywhere in a town, and near a place.
_NEEDED, _NEEDED_NEAR = 1000.0, 400.0
# Metres per unit of an odometry, and the largest ratio of the ends of a range: within 0.3..3, a
# drive is located, within 0.1..10 it is not.
_LEAST_SCALE, _MOST_SCALE, _WIDEST = 1e-3, 1e3, 10.0
_TRAJECTORIES = ('.tum', '.txt')
# Latitude and longitude, to a decimetre.
_PLACE = '{:.6f}, {:.6f}'

_EPILOG = f"""
SOURCE is a recording, the output folder of `phase_traj replay --output DIR`, a trajectory of any
other odometry in the TUM format (.tum or .txt, lines of stamp x y z qx qy qz qw), or a .txt file
with the line of equal links that the topic ~/links has. A recording is replayed first, with the
parameters given.

{SOURCE_HELP.replace('SOURCE is', 'A recording is')}
A map is an extract of OpenStreetMap: docs/how-to/locate.md says where to get one, and what its
licence asks for. DIR receives location.csv (one row per pose), track.geojson, track.gpx,
location.html and, of a recording, all results of a replay; chain_code.json has the key location.
If the place is not known at any pose, the exit status is 1; the files are written nevertheless.
"""

COMMAND = Command(
    'locate', summary='find where on a road map a drive was, without GPS',
    example='phase_traj locate drive.mp4 --map town.osm.pbf -p camera_height:=1.65'
            ' --output results',
    epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    add_source(parser)
    parser.add_argument(
        '--map', metavar='FILE', type=Path, required=True,
        help='the road map: .osm.pbf, .osm, .osm.gz or .osm.bz2')
    parser.add_argument(
        '--near', metavar='LAT,LON,RADIUS', type=_near,
        help='a rough start, such as 49.01,8.40,2km; it also says that the drive is on the map (a'
             ' negative latitude: --near=-33.92,18.42,2km; default: anywhere on the map)')
    parser.add_argument(
        '--scale', metavar='A..B', type=_scale,
        help='metres per unit of the odometry, such as 0.5..3, B up to 10 times A (default:'
             ' 0.9..1.1 for metres, 1.1..2.2 for camera heights)')
    parser.add_argument(
        '--roads', choices=[each.value for each in Roads], default=Roads.CAR.value,
        help='roads that a car may drive, or paths as well (default: car)')
    parser.add_argument(
        '--level', metavar='P', default=0.99,
        type=number('a probability from 0.5 to below 1', lambda level: 0.5 <= level < 1.0),
        help='probability above which a place is claimed, after some turns (default: 0.99)')
    parser.add_argument(
        '--output', metavar='DIR', type=Path,
        help='write the results here (default: into SOURCE, if it is the output folder of a'
             ' replay, otherwise only print)')
    add_force(parser)
    add_parameters(parser)


def run(options: Namespace) -> int | None:
    """Run the command; return the exit status, None if the place is known."""
    if options.output is None and _is_results(options.source):
        options.output = options.source
    roads = read_roads(options.map, Roads(options.roads))
    if options.near is not None:
        # A wrong place is reported before the work.
        options.near.prior(roads)
    if options.output is not None:
        check_directory(
            options.output, names=LOCATION_FILES, inputs=(options.map,), force=options.force)
    source: Path = options.source
    odometry, codes, replayed = _odometry(options)
    names = LOCATION_FILES if codes is None else (*LOCATION_FILES, CODES)
    with ExitStack() as stack:
        # A folder that cannot be written is reported before the search.
        directory = None if options.output is None else stack.enter_context(output_directory(
            options.output, names=names, adds=True, inputs=(options.map,), force=options.force))
        with progress(total=len(odometry.motions), title='locating') as bar:
            located = locate(
                odometry, roads, near=options.near, scale=options.scale, level=options.level,
                advance=bar.update)
        if directory is not None:
            write_location(located, directory, title=source.name or str(source), codes=codes)
    # After the results are complete: if the output is closed, printing raises an error.
    if replayed is not None:
        print_camera(replayed)
        print_doubts(replayed)
    _print(located)
    if options.output is not None:
        print(f'written to {options.output}, see {REPORT}')
    return None if located.first_claim is not None else EXIT_NOT_KNOWN


def _odometry(options: Namespace) -> tuple[DriveOdometry, Path | None, Replay | None]:
    """Return the odometry, its chain_code.json, and the replay that it comes from, if any."""
    source: Path = options.source
    of_results = _is_results(source)
    if of_results or (source.suffix in _TRAJECTORIES and source.is_file()):
        _refuse_replaying(options)
        return read_odometry(source), source / CODES if of_results else None, None
    request = request_of(options, source, also_read=(options.map,))
    with request.opened() as opened:
        result = replay_source(
            opened, request,
            through=over_passes(total=opened.frame_count, title=request.title))
    codes = None if options.output is None else options.output / CODES
    return odometry_of(result), codes, result


def _refuse_replaying(options: Namespace) -> None:
    """Refuse the options of a replay where the source is not replayed."""
    parser = ArgumentParser()
    add_source(parser)
    add_parameters(parser)
    defaults = vars(parser.parse_args(['']))
    given = [
        f'--{name.replace("_", "-")}' for name, default in defaults.items()
        if name != 'source' and getattr(options, name) != default]
    if given:
        raise ParameterError(
            f'{options.source} is not replayed: leave out {", ".join(given)}, or give the'
            ' recording')


def _is_results(source: Path) -> bool:
    """Return whether a source is the output folder of a replay."""
    return source.is_dir() and (source / CODES).exists()


def _print(located: Located) -> None:
    poses, roads = located.poses, located.roads
    driven = poses[-1].driven * located.scale.middle
    print(f'{located.odometry.source}: {len(poses)} poses, about {driven:.0f} m;'
          f' {roads.source}: {roads.length / 1e3:.0f} km of road')
    first, last = located.first_claim, poses[-1].estimate
    found = _reason(located) if first is None else _PLACE.format(*located.degrees(first.estimate))
    print(f'{verdict(located)}: {found}')
    if not last.claimed:
        print(f'at the end: not known, probability {last.probability:.3f} of the best place')
    else:
        print(f'at the end: {_PLACE.format(*located.degrees(last))}, bearing'
              f' {bearing_deg(last.heading):.0f}°, standard deviation'
              f' {last.standard_deviation:.1f} m, probability {last.probability:.3f}')
    print(f'map data {ATTRIBUTION}')


def _reason(located: Located) -> str:
    if located.odometry.straight:
        return ('the drive has no turn, and a straight road fits in many places: give a longer'
                ' drive, or --near')
    needed = _NEEDED if located.near is None else _NEEDED_NEAR
    if located.poses[-1].driven * located.scale.middle < needed:
        return (f'the drive is too short: give one of about {needed:.0f} m with several turns'
                + (', or --near' if located.near is None else ''))
    return ('no place of the map fits better than all others: give a longer drive, and check that'
            ' the map has its roads, and that --scale includes that of the odometry')


def _near(text: str) -> Near:
    kilometres = text.rstrip().endswith('km')
    numbers = text.rstrip().removesuffix('km' if kilometres else 'm').split(',')
    try:
        latitude, longitude, radius = map(float, numbers)
    except ValueError:
        raise ArgumentTypeError(
            f'{text!r} is not a place: give LAT,LON,RADIUS, such as 49.01,8.40,2km') from None
    radius *= 1000.0 if kilometres else 1.0
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        raise ArgumentTypeError(f'{text!r} is not on the earth: give degrees, the latitude first')
    if not 0.0 < radius < 1e7:
        raise ArgumentTypeError(f'the radius in {text!r} is not positive: give metres, or 2km')
    return Near(latitude, longitude, radius)


def _scale(text: str) -> ScaleRange:
    least, dots, most = text.partition('..')
    try:
        scale = ScaleRange(float(least), float(most if dots else least))
    except ValueError:
        raise ArgumentTypeError(
            f'{text!r} is not a range: give two positive numbers, such as 0.5..3') from None
    if scale.most > _WIDEST * scale.least or not _LEAST_SCALE <= scale.least < _MOST_SCALE:
        raise ArgumentTypeError(
            f'{text!r} is too wide, or not metres: give numbers from {_LEAST_SCALE:g} to'
            f' {_MOST_SCALE:g}, the larger one up to {_WIDEST:g} times the smaller, such as'
            ' 0.5..3')
    return scale
