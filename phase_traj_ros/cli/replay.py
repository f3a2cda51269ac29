# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj replay``: a recording in, codes and trajectory out."""

from argparse import Namespace
from contextlib import closing, ExitStack
from pathlib import Path
import time
from typing import Any

from phase_traj_ros.cli.options import (
    add_command,
    add_parameters,
    add_source,
    parameters_of,
    SOURCE_HELP,
    source_of,
)
from phase_traj_ros.cli.progress import progress
from phase_traj_ros.cli.report import print_codes
from phase_traj_ros.io.output import output_directory
from phase_traj_ros.io.picture import require_matplotlib
from phase_traj_ros.io.prefetch import prefetch
from phase_traj_ros.io.replay import Replay, replay
from phase_traj_ros.io.results import write_results

_EPILOG = f"""
{SOURCE_HELP}
DIR receives chain_code.json, shifts.csv (one row per pair of frames), trajectory.tum and
trajectory.png; it is made if absent.
"""


def add_parser(commands: Any) -> None:
    """Add the command to the parser."""
    parser = add_command(
        commands, 'replay', summary='code a recording offline, as fast as it goes',
        epilog=_EPILOG)
    add_source(parser)
    add_parameters(parser)
    parser.add_argument(
        '--output', metavar='DIR', type=Path, help='write the results here (default: only print)')
    parser.set_defaults(run=run)


def run(options: Namespace) -> None:
    """Run the command."""
    parameters = parameters_of(options)
    with ExitStack() as stack:
        directory = None
        source = stack.enter_context(source_of(options))
        if options.output is not None:
            require_matplotlib()
            directory = stack.enter_context(output_directory(options.output))
        began = time.monotonic()
        with closing(prefetch(source)) as frames:
            result = replay(
                progress(frames, total=source.frame_count, title=options.source.name),
                parameters, source=source.description)
        seconds = time.monotonic() - began
        if directory is not None:
            write_results(result, directory)
    _print(result, seconds, options.output)


def _print(result: Replay, seconds: float, output: Path | None) -> None:
    print(f'{result.source}: {result.frames} frames in {seconds:.1f} s'
          f' ({result.frames / seconds:.0f} frames/s)')
    print_codes(result.codes)
    for count, what in (
            (result.counters.repeated, 'frames with the stamp of the one before were dropped'),
            (result.counters.time_resets, 'times the stamps went back, and everything started'
                                          ' anew'),
            (result.counters.unmeasured, 'pairs had nothing to correlate'),
            (result.counters.reprimed, 'times the size of the frames changed')):
        if count:
            print(f'warning: {count} {what}')
    if output is not None:
        print(f'written to {output}')
