# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj evaluate``: compares a replay with the ground truth."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from phase_traj_ros.cli.options import add_force, Command
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.tasks.evaluation.evaluate import (
    evaluate,
    Evaluation,
    PathErrors,
    write_evaluation,
)
from phase_traj_ros.tasks.evaluation.ground_truth import read_ground_truth
from phase_traj_ros.tasks.evaluation.picture import write_evaluation_picture
from phase_traj_ros.tasks.evaluation.replayed_drive import read_replay

_EPILOG = """
DIR is the output folder of `phase_traj replay --output DIR`; it receives evaluation.json and
evaluation.png. If the replay did not measure the heading (docs/how-to/camera.md), only the codes
and the path drawn from them are compared. A path in metres (from the heading, with a camera_height
or a speed) is scored as odometry in the plane: distance, t_rel and r_rel as in KITTI's benchmark,
and ATE.

FILE is one of
  KITTI poses       lines of 12 numbers; matched by time if times.txt is beside it or the time
                    comes first (13 numbers), otherwise pose i belongs to frame i of the recording
  a TUM file        lines of stamp x y z qx qy qz qw
All poses are converted to be relative to the first frame.
"""

COMMAND = Command(
    'evaluate', summary='compare a replay with the true trajectory',
    example='phase_traj evaluate results --ground-truth poses.txt', epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    parser.add_argument('directory', metavar='DIR', type=Path, help='results of a replay')
    parser.add_argument(
        '--ground-truth', metavar='FILE', type=Path, required=True, help='the true trajectory')
    parser.add_argument(
        '--align-start', action='store_true',
        help='the first pose belongs to the first frame of the replay: for times of different'
             ' clocks')
    add_force(parser)


def run(options: Namespace) -> None:
    """Run the command."""
    drive = read_replay(options.directory)
    evaluation, true = evaluate(
        drive, read_ground_truth(options.ground_truth), align_start=options.align_start)
    with output_directory(
            options.directory, names=('evaluation.json', 'evaluation.png'), adds=True,
            inputs=(options.ground_truth,), force=options.force) as directory:
        write_evaluation(
            evaluation, directory / 'evaluation.json', source=drive.source,
            ground_truth=str(options.ground_truth))
        write_evaluation_picture(drive, true, evaluation, directory / 'evaluation.png')
    _print(evaluation, len(drive.stamps_ns))
    print(f'written to {options.directory}')


def _print(evaluation: Evaluation, replayed: int) -> None:
    covered = f' of {replayed}' if evaluation.frames < replayed else ''
    print(f'{evaluation.frames}{covered} frames, {evaluation.length_m:.0f} m')
    turns, heading = evaluation.turns, evaluation.heading_error_deg
    if turns is None or heading is None:
        print('heading and turns: not measured (replay with focal_px, hfov_deg or a calibration)')
    else:
        print(f'turns: {turns.found} found, {turns.true} true, precision {turns.precision:.3f},'
              f' recall {turns.recall:.3f}')
        far = '' if heading.per_100m is None else f', {heading.per_100m:.2f} per 100 m'
        print(f'heading error in degrees: rms {heading.rms:.2f}, end {heading.end:+.2f}, max'
              f' {heading.max:.2f}{far}')
    direction, shape = evaluation.direction, evaluation.shape_error
    print(f'direction codes: equal to the true ones at {direction.agreement:.1%} of the frames;'
          f' turns {_codes(direction.changes)}, true {_codes(direction.true_changes)}')
    for name, error in (
            ('path drawn from the codes', shape.codes),
            ('path drawn from the heading', shape.heading),
            ('path as written by the replay', shape.path)):
        if error is not None:
            print(f'{name}: error {error:.1%} of its size')
    _print_odometry(evaluation.path_errors)


def _print_odometry(errors: PathErrors) -> None:
    """Print the scores of the path as odometry, in the plane."""
    distance, gained, turned = (
        errors.distance_error_percent, errors.t_rel_percent, errors.r_rel_deg_per_100m)
    if distance is not None:
        print(f'distance error: {distance:+.1f} %')
    if gained is not None and turned is not None:
        print(f't_rel {gained:.2f} %, r_rel {turned:.2f} degrees per 100 m, in the plane')
    if errors.ate_scaled_m is not None:
        unscaled = '' if errors.ate_m is None else f'{errors.ate_m:.2f} m, '
        print(f'absolute error (ATE): {unscaled}{errors.ate_scaled_m:.2f} m when scaled to fit')


def _codes(changes: tuple[int, ...]) -> str:
    return ' '.join(map(str, changes)) or 'none'
