# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj inspect``: shows the phase correlation of two frames."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from phase_traj_ros.cli.options import Command
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.errors import FrameError, OutputError, SourceError
from phase_traj_ros.io.images.decoding import PICTURE_SUFFIXES, read_picture
from phase_traj_ros.io.outputs.outputs import output_file
from phase_traj_ros.io.results.figures import write_correlation_picture

_EPILOG = """
dx is the displacement of the image content from A to B in pixels, positive to the right: the
camera turned left. The response is the height of the peak: 1 for identical frames, about 0.1 in
real driving, 0.01 to 0.02 for unrelated frames.
"""

COMMAND = Command(
    'inspect', summary='show the phase correlation of two frames',
    example='phase_traj inspect drive/000100.png drive/000101.png --output map.png',
    epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    parser.add_argument('first', metavar='A', type=Path, help='image file of the first frame')
    parser.add_argument(
        'second', metavar='B', type=Path, nargs='?', help='image file of the second frame')
    parser.add_argument(
        '--output', metavar='FILE', type=Path,
        help='write the correlation map to this figure, and replace one that is there')


def run(options: Namespace) -> None:
    """Run the command."""
    for frame in (options.first, options.second):
        _require_picture(frame)
    if options.output is not None:
        _require_elsewhere(options.output, (options.first, options.second))
    first, second = read_picture(options.first), read_picture(options.second)
    correlator = PhaseCorrelator()
    correlator.update(first)
    shift = correlator.update(second)
    if shift is None:
        raise FrameError(
            f'the frames differ in size or type: {options.first} is {_size(first)},'
            f' {options.second} is {_size(second)}')
    if options.output is not None:
        with output_file(options.output, inputs=(options.first, options.second)) as path:
            write_correlation_picture(first, second, correlator.correlation_map(), shift, path)
    print(f'dx {shift.dx:+.3f} px, dy {shift.dy:+.3f} px, response {shift.response:.4f}')
    if options.output is not None:
        print(f'written to {options.output}')


def _require_picture(frame: Path | None) -> None:
    if frame is None or (frame.exists() and frame.suffix.lower() not in PICTURE_SUFFIXES):
        what = 'the second image is missing' if frame is None else f'{frame} is not an image'
        raise SourceError(
            f'{what}: give two images, A and B; ffmpeg -i VIDEO -ss SECONDS -frames:v 2 %d.png'
            ' takes them from a video')


def _require_elsewhere(output: Path, frames: Iterable[Path]) -> None:
    """Refuse a figure that would become a frame of the folder."""
    folder = output.absolute().parent
    if folder.resolve() in {frame.absolute().parent.resolve() for frame in frames}:
        raise OutputError(
            f'{output} would lie beside the frames, and a replay of {folder} would read it: choose'
            ' another --output')


def _size(image: Any) -> str:
    height, width = image.shape
    return f'{width}x{height} {image.dtype}'
