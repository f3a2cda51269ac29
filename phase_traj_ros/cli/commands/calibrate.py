# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj calibrate``: learns the camera from the turns of one or several drives."""

from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path

from phase_traj_ros.cli.options import add_source, Command, SOURCE_HELP, source_of
from phase_traj_ros.cli.report import progress, warn
from phase_traj_ros.core import CameraEstimate, CameraInUse, Lens
from phase_traj_ros.core.camera.estimate import combined
from phase_traj_ros.errors import ParameterError, ResultError
from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.outputs import Outputs
from phase_traj_ros.io.replay.camera import learned_lens
from phase_traj_ros.io.results.camera_file import camera_values, write_camera
from phase_traj_ros.io.sources.prefetch import prefetch
from phase_traj_ros.parameters import Parameters

EXIT_NOT_TOLD = 1
_SUFFIX = '.yaml'

_EPILOG = f"""
{SOURCE_HELP}
While the vehicle turns, the image moves faster at its edges than in its middle. From this follow
the focal length, the kind of lens and the tilt. One turn of 60 degrees or more is enough, three
are better. All recordings have to be of the same camera. Pass FILE.yaml to --params or to the
node. If the camera cannot be learned, the exit status is 1 and FILE.yaml is not written.
"""

COMMAND = Command(
    'calibrate', summary='learn the camera from the turns of recordings',
    example='phase_traj calibrate drive.mp4 --output camera.yaml', epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    add_source(parser, several=True)
    parser.add_argument(
        '--upside-down', action='store_true', help='the camera is mounted upside down')
    parser.add_argument(
        '--output', metavar='FILE.yaml', type=Path,
        help='write the camera to this parameter file, and replace one that is there')


def run(options: Namespace) -> int:
    """Run the command; return the exit status."""
    if options.output is not None and options.output.suffix != _SUFFIX:
        # Reported before the work.
        raise ParameterError(f'--output is {options.output}: its name has to end in {_SUFFIX}')
    found: list[CameraEstimate | None] = []
    try:
        with Outputs(inputs=options.sources) as outputs:
            # A place that cannot be written is reported before the work.
            staged = None if options.output is None else outputs.file(options.output)
            for path in options.sources:
                found.append(_learn(options, path))
            told = [estimate for estimate in found if estimate is not None]
            try:
                camera = combined(told) if len(told) > 1 else next(iter(told), None)
            except ValueError as error:
                raise ResultError(str(error)) from None
            if staged is not None and camera is not None:
                with writing_to(options.output):
                    write_camera(camera, staged, rotate_180=options.upside_down)
    finally:
        # After the file is complete: if the output is closed, printing raises an error.
        for path, estimate in zip(options.sources, found):
            print(f'{path}: {_words(estimate)}')
    if camera is None:
        print('the camera was not learned: give a drive with a turn of 60 degrees or more')
        return EXIT_NOT_TOLD
    if len(told) > 1:
        print(f'together: {_words(camera)}')
    for name, value in camera_values(camera).items():
        print(f'parameter: {name}: {value}')
    if options.upside_down:
        print('parameter: rotate_180: true')
    if options.output is not None:
        print(f'written to {options.output}')
    return 0


def _learn(options: Namespace, path: Path) -> CameraEstimate | None:
    parameters = Parameters(rotate_180=options.upside_down)
    with source_of(options, path) as source, closing(prefetch(source.entries())) as frames:
        shown = progress(frames, total=source.frame_count, title=path.name or str(path))
        lens = learned_lens(shown, parameters, source.description)
        problem = source.frames.problem
    if problem is not None:
        warn(f'{path}: {problem}')
    return None if lens is None else lens.estimate


def _words(estimate: CameraEstimate | None) -> str:
    if estimate is None:
        return 'the camera cannot be learned from its turns'
    return str(CameraInUse.of(Lens(estimate=estimate), estimate.width))
