# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj replay``: computes codes and trajectory of a recording."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator
from pathlib import Path
import time

from phase_traj_ros.cli.commands.replay_many import add_batch, replay_many
from phase_traj_ros.cli.options import (
    add_force,
    add_parameters,
    add_source,
    Command,
    parameters_help,
    request_of,
    SOURCE_HELP,
)
from phase_traj_ros.cli.report import over_passes, print_doubts, print_result
from phase_traj_ros.io.sources.base import Entry
from phase_traj_ros.tasks.batch.job import replay_source

_EPILOG = f"""
{SOURCE_HELP}
DIR receives chain_code.json, shifts.csv (one row per pair of frames), trajectory.tum and
trajectory.png; it is created if absent.

Several sources are replayed in parallel processes. Each has a folder in DIR with its name, and
DIR receives summary.csv and summary.html with one row per source. If one fails, the others
continue, and the exit status is 1.

{parameters_help()}"""

COMMAND = Command(
    'replay', summary='code recordings offline, as fast as possible',
    example='phase_traj replay drive.mp4 --output results --report', epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    add_source(parser, several=True)
    add_parameters(parser)
    parser.add_argument(
        '--strict', action='store_true',
        help='fail at a frame that cannot be read or used (default: skip it, and count it)')
    parser.add_argument(
        '--output', metavar='DIR', type=Path, help='write the results here (default: only print)')
    parser.add_argument(
        '--report', action='store_true',
        help='also write report.html to DIR: one self-contained file')
    parser.add_argument('--svg', action='store_true', help='also write the picture as SVG')
    parser.add_argument(
        '--bag-out', metavar='FILE.mcap', type=Path,
        help='write all topics of the node to this bag, with the stamps of the images (for'
             ' several sources: a name; each writes it to its own folder)')
    parser.add_argument(
        '--bag-debug-images', action='store_true', help='also write the debug images to the bag')
    add_force(parser)
    add_batch(parser)


def run(options: Namespace) -> int | None:
    """Run the command; return the exit status, None for success."""
    request = request_of(options, options.sources[0])
    if len(options.sources) > 1 or options.dask is not None:
        return replay_many(request, options)
    # Of the frames in all passes, without what comes after.
    seconds = 0.0

    def timed(frames: Iterable[Entry], which: str) -> Iterator[Entry]:
        nonlocal seconds
        began = time.monotonic()
        # Learning the camera may stop before the last frame.
        try:
            yield from shown(frames, which)
        finally:
            seconds += time.monotonic() - began

    with request.opened() as source:
        shown = over_passes(total=source.frame_count, title=request.title)
        result = replay_source(source, request, through=timed)
    print(f'{result.source}: {result.frames} frames in {seconds:.1f} s'
          f' ({result.frames / seconds:.0f} frames/s)')
    print_result(result)
    print_doubts(result)
    for written in (request.output, request.bag_out):
        if written is not None:
            print(f'written to {written}')
    return None
