# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A drive: a camera, its pose at every frame, the scene, the ground truth, and the frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic.arrays import Bytes, Floats, Ints
from phase_traj_ros.synthetic.camera import Camera, KITTI_CAMERA, Pose
from phase_traj_ros.synthetic.degradations import sensor_noise
from phase_traj_ros.synthetic.drive.plan import borders, check, drive_plan, Plan, Turn
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.synthetic.town.ready import roads_along, scene_along, street_grid
from phase_traj_ros.synthetic.town.streets import grid_roads
from phase_traj_ros.synthetic.view.renderer import render

#: Stamp of the first frame, in nanoseconds: a day in November 2023.
EPOCH_NS = 1_700_000_000_000_000_000

#: Streets nearer to each other than this are merged, in metres.
_SAME_STREET = 20.0
#: If the blocks between the streets of a drive are larger than this, streets are inserted.
_LARGEST_BLOCK = 110.0
#: Standard deviation of the noise of the sensor by day, in grey levels.
_NOISE = 1.0


@dataclass(frozen=True, slots=True)
class TrueTurn:
    """
    A true turn.

    It begins with the motion after frame ``start_frame`` and ends at ``end_frame``.
    ``angle_deg`` is positive to the left.
    """

    start_frame: int
    end_frame: int
    angle_deg: float


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """
    A drive through a scene, seen by one camera.

    ``stamps_ns``: (N,) integer nanoseconds; ``poses``: (N, 5) x, y in metres, yaw, pitch, roll in
    radians (REP 103); ``turns``: the true turns, as far as known; ``build_scene``: builds the
    scene, the same on every call; ``build_roads``: returns the centre lines (N, 2) of its roads.
    """

    name: str
    stamps_ns: Ints
    poses: Floats
    camera: Camera
    build_scene: Callable[[], Scene]
    turns: tuple[TrueTurn, ...] = ()
    build_roads: Callable[[], Sequence[Floats]] = tuple

    def __post_init__(self) -> None:
        """Check that the arrays match; make them read-only."""
        if self.poses.shape != (len(self.stamps_ns), 5):
            raise ParameterError(
                f'a drive needs one pose (x, y, yaw, pitch, roll) for each of its '
                f'{len(self.stamps_ns)} stamps, not an array of shape {self.poses.shape}')
        if len(self.stamps_ns) > 1 and np.diff(self.stamps_ns).min() <= 0:
            raise ParameterError('the stamps of a drive must rise from frame to frame')
        for array in (self.stamps_ns, self.poses):
            array.flags.writeable = False

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.stamps_ns)

    def pose(self, frame: int) -> Pose:
        """Return the pose of the camera at this frame."""
        return Pose(*self.poses[frame].tolist())

    def take(self, frames: npt.ArrayLike) -> Drive:
        """
        Return the drive reduced to these frames, given by rising indices.

        Turns that begin before the first of them or end after the last are dropped.
        """
        index = np.asarray(frames, np.int64)
        turns = tuple(
            TrueTurn(
                int(np.searchsorted(index, turn.start_frame, side='right')) - 1,
                int(np.searchsorted(index, turn.end_frame)), turn.angle_deg)
            for turn in self.turns
            if len(index) and index[0] <= turn.start_frame and turn.end_frame <= index[-1])
        return replace(self, stamps_ns=self.stamps_ns[index], poses=self.poses[index], turns=turns)


def _check_rate(rate_hz: float) -> None:
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise ParameterError(f'the rate is {rate_hz} frames per second: give a number above 0')


def _true_turns(plan: Plan, rate_hz: float) -> tuple[TrueTurn, ...]:
    return tuple(
        TrueTurn(
            int(np.floor(begin * rate_hz + 1e-6)), int(np.ceil(end * rate_hz - 1e-6)),
            segment.angle_deg)
        for (segment, (begin, end)) in zip(plan, pairwise(borders(plan)))
        if isinstance(segment, Turn))


def _filled(lines: Sequence[float]) -> list[float]:
    """Merge streets that are almost the same, and insert some where the blocks are too large."""
    streets: list[float] = []
    for line in sorted(lines):
        if streets and line - streets[-1] < _SAME_STREET:
            continue
        if streets and line - streets[-1] > _LARGEST_BLOCK:
            between = int((line - streets[-1]) // (0.75 * _LARGEST_BLOCK))
            streets += np.linspace(streets[-1], line, between + 2)[1:-1].tolist()
        streets.append(line)
    return streets


def _grid_under(poses: Floats) -> tuple[list[float], list[float]]:
    """Return the streets, along y and along x, of a grid for a drive along x and y only."""
    (x, y, yaw) = poses[:, :3].T
    quarters = np.rint(yaw / (np.pi / 2))
    straight = np.abs(yaw - quarters * np.pi / 2) < 1e-6
    (along_x, along_y) = (straight & (quarters % 2 == 0), straight & (quarters % 2 == 1))
    return (
        _filled([*x[along_y], x.min() - 45.0, x.max() + 60.0]),
        _filled([*y[along_x], y.min() - 75.0, y.max() + 65.0]))


def plan_drive(
    name: str, plan: Plan, *, rate_hz: float = 10.0, speed: float = 7.0,
    camera: Camera = KITTI_CAMERA, seed: int = 0,
) -> Drive:
    """
    Return the drive that follows a plan, at ``speed`` m/s in segments without a speed.

    There is one frame at the start and one after each 1 / rate up to the end: 24 s at 10 Hz are
    241 frames. If all turns are multiples of 90 degrees, the drive is through a grid of streets,
    otherwise along a single street. Raises `ParameterError` if the plan cannot be driven.
    """
    check(plan, speed)
    _check_rate(rate_hz)
    count = int(np.floor(borders(plan)[-1] * rate_hz + 1e-6)) + 1
    drive = pose_drive(
        name, drive_plan(plan, np.arange(count) / rate_hz, speed=speed), rate_hz=rate_hz,
        camera=camera, seed=seed, turns=_true_turns(plan, rate_hz))
    if any(segment.angle_deg % 90 for segment in plan):
        return drive
    (xs, ys) = _grid_under(drive.poses)
    return replace(
        drive, build_roads=partial(grid_roads, xs, ys),
        build_scene=partial(street_grid, xs, ys, seed=seed, clear_of=drive.poses[:, :2]))


def pose_drive(
    name: str, poses: npt.ArrayLike, *, rate_hz: float = 10.0, camera: Camera = KITTI_CAMERA,
    seed: int = 0, turns: tuple[TrueTurn, ...] = (),
) -> Drive:
    """
    Return the drive along given poses (N, 3 or 5): x, y, yaw[, pitch, roll], in a street.

    Frames are 1 / ``rate_hz`` apart. Poses are in metres and radians, REP 103.
    """
    given = np.array(poses, np.float64)
    if given.ndim != 2 or given.shape[1] not in (3, 5) or not len(given):
        raise ParameterError(
            f'poses must be (N, 3) or (N, 5) with N of at least 1, not of shape {given.shape}')
    _check_rate(rate_hz)
    stamps_ns = EPOCH_NS + np.rint(np.arange(len(given)) * (1e9 / rate_hz)).astype(np.int64)
    full = np.zeros((len(given), 5))
    full[:, :given.shape[1]] = given
    return Drive(
        name, stamps_ns, full, camera,
        partial(scene_along, full[:, :2], seed=seed), turns,
        partial(roads_along, full[:, :2], seed=seed))


def render_drive(drive: Drive, *, scene: Scene | None = None) -> Iterator[Bytes]:
    """
    Yield the frames of a drive in order, each (height, width) uint8, with the sensor's noise.

    The noise has a standard deviation of one grey level: a camera that stands gives no picture
    twice. Each frame is rendered on demand, so a drive may have any length. ``scene`` is the scene
    of the drive, if it has been built already.
    """
    seen = drive.build_scene() if scene is None else scene
    for frame in range(len(drive)):
        picture = render(seen, drive.camera, drive.pose(frame))
        yield sensor_noise(picture, sigma=_NOISE, seed=frame)
