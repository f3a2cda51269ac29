# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj calibrate``: the camera's field of view, from the turns of a drive."""

from argparse import Namespace
from contextlib import closing
from typing import Any

from phase_traj_ros.cli.command import Command
from phase_traj_ros.cli.options import add_source, SOURCE_HELP, source_of
from phase_traj_ros.cli.progress import progress
from phase_traj_ros.core import CodeSource
from phase_traj_ros.core.camera.field_of_view import SURE
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.messages.diagnostics import described
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.prefetch import prefetch
from phase_traj_ros.parameters import Parameters

_EPILOG = f"""
{SOURCE_HELP}
Streets mostly turn by right angles, so the angles of the turns tell the field of view; a drive
through a town with five turns or more will do. It rests on right angles: turns that are all of
another angle, as on a test track, mislead it. A calibration with a chessboard is more accurate.
The exit status is 1 where the turns do not tell it with some certainty.
"""

COMMAND = Command(
    'calibrate', summary="estimate the camera's field of view from a drive",
    example='phase_traj calibrate drive.mp4', epilog=_EPILOG)


def add_parser(commands: Any) -> None:
    """Add the command to the parser."""
    parser = COMMAND.add_to(commands)
    add_source(parser)
    parser.add_argument(
        '--upside-down', action='store_true', help='the camera is mounted upside down')
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Run the command; return the exit status."""
    parameters = Parameters(
        code_source=CodeSource.HEADING.value, estimate_fov=True, rotate_180=options.upside_down)
    with source_of(options) as source, closing(prefetch(source)) as frames:
        shown = progress(frames, total=source.frame_count, title=options.source.name)
        result = replay(shown, parameters, source=source.description)
    view = result.field_of_view
    if view is None or view.turns == 0:
        raise ResultError(
            f'{source.description}: no turn of 30 degrees or more, so nothing tells the field of'
            ' view: give a drive with turns')
    print(f'field of view in degrees: {described(view)}')
    if view.sureness < SURE:
        print('not certain: give a drive with more turns at right angles')
        return 1
    print(f'parameter: hfov_deg: {view.hfov_deg:.1f}')
    return 0
