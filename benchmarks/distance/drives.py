# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the distance study: drives, and obstacles in the camera's view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from benchmarks.heading.drives import Frame, Ride, streamed
from benchmarks.shared.clips import at_axle, KITTI_LEVER_M, kitti_poses
import cv2
import numpy as np
from phase_traj_ros.core import Odometry
from phase_traj_ros.synthetic import (
    Camera,
    KITTI_CAMERA,
    plan_drive,
    pose_drive,
    poses_from_kitti,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.camera import EQUIDISTANT
from phase_traj_ros.tasks.evaluation.scores import way_along

#: Sequences along whose poses whole drives are rendered.
SEQUENCES = ('00', '02', '08', '10')
#: Pitch of the rendered cameras, downwards.
MOUNTED = np.radians(1.0)
# Largest deflection of the springs; where the poses show more, they are wrong (sequence 08).
_SPRINGS = np.radians(2.0)
# Over this many metres, the path gives the slope and bank of the road, without the springs.
_ROAD_M = 10.0

CAMERAS = {
    '1241×376, 82°, 10 Hz': (KITTI_CAMERA, 10.0),
    '320×240, 62°, 20 Hz': (Camera.with_field_of_view(320, 240, 62), 20.0),
    '640×400, 110°, 10 Hz': (Camera.with_field_of_view(640, 400, 110), 10.0),
    '800×600 fisheye, 140°, 10 Hz': (
        Camera.with_field_of_view(800, 600, 140, fisheye=EQUIDISTANT), 10.0),
    '1280×720, 70°, 10 Hz': (Camera.with_field_of_view(1280, 720, 70), 10.0),
}
BLOCK = [Straight(4), Turn(90, 4, 5), Straight(3), Turn(-90, 3, 5), Straight(4)]


def along_kitti(sequence: str) -> Ride:
    """
    Return the drive along a whole KITTI sequence, streamed.

    The rendered road is flat, so the camera has the real pitch and roll relative to the road: the
    angles of the poses minus the slope of the path and the roll, both over about 10 m.
    """
    matrices = kitti_poses(sequence)
    assert matrices is not None
    poses = poses_from_kitti(matrices)
    height = -matrices.reshape(-1, 3, 4)[:, 1, 3]
    way = way_along(poses[:, :2])
    before, after = way - _ROAD_M / 2, way + _ROAD_M / 2
    climbed = np.interp(after, way, height) - np.interp(before, way, height)
    run = np.clip(after, 0, way[-1]) - np.clip(before, 0, way[-1])
    # Pitch is positive nose down.
    pitch = poses[:, 3] + np.arctan2(climbed, np.maximum(run, 1e-3))
    poses[:, 3] = np.clip(pitch - np.median(pitch), -_SPRINGS, _SPRINGS) + MOUNTED
    poses[:, 4] -= [
        poses[(way >= low) & (way <= high), 4].mean() for low, high in zip(before, after)]
    return streamed(pose_drive(f'along KITTI {sequence}', poses, seed=1))


def motorway(speed: float) -> Ride:
    """Return a straight road and a gentle bend at a speed in metres per second."""
    return _planned(f'motorway, {speed:.0f} m/s', [Straight(6), Turn(20, 8), Straight(6)], speed)


def stop_and_go() -> Ride:
    """Return a drive through a town with starts and stops."""
    return _planned('stop and go', [
        Straight(3), Straight(3, 0), Straight(3), Straight(2, 1.5), Straight(3, 0), Straight(3),
        Turn(90, 4, 4), Straight(3, 0), Straight(3)], 9.0)


def block(
    camera: str = '1241×376, 82°, 10 Hz', *, aside_deg: float = 0.0, roll_deg: float = 0.0,
) -> Ride:
    """
    Return a drive around a block as seen by one of the cameras, which looks down slightly.

    The camera points ``aside_deg`` to the left, and rolls by ``roll_deg``, positive right side
    down.
    """
    lens, rate_hz = CAMERAS[camera]
    name = f'block, {camera}' + (f', {aside_deg:.0f}° aside' if aside_deg else '') + (
        f', roll of {roll_deg:.0f}°' if roll_deg else '')
    return _planned(
        name, BLOCK, 9.0, lens, rate_hz, aside=np.radians(aside_deg), roll=np.radians(roll_deg))


def bicycle(*, rate_hz: float = 15.0, shaking_deg: float = 0.0) -> Ride:
    """
    Return a ride around corners on a bicycle, which leans to the inside by up to 18 degrees.

    The pitch and the roll of each frame scatter by ``shaking_deg``, the yaw by half of it.
    """
    corner = Turn(90, 3, 4.5)
    plan = [Straight(3), corner, Straight(3), replace(corner, angle_deg=-90), Straight(3), corner,
            Straight(3)]
    name = 'bicycle' + (
        f', {rate_hz:.0f} Hz, shakes by {shaking_deg:.1f}°' if shaking_deg else '')
    return _planned(
        name, plan, 5.5, Camera.with_field_of_view(640, 480, 70), rate_hz, balances=True,
        shaking=np.radians(shaking_deg))


class FoundPath:
    """The poses x, y, yaw that an estimator finds, and their covariances, from the start on."""

    def __init__(self) -> None:
        self._poses = [(0.0, 0.0, 0.0)]
        self._covariances = [np.zeros((3, 3))]

    def add(self, odometry: Odometry | None) -> None:
        """Add the pose at the next frame; where there is none, its covariance is NaN."""
        if odometry is None:
            self._poses.append(self._poses[-1])
            self._covariances.append(np.full((3, 3), np.nan))
        else:
            pose = odometry.pose
            self._poses.append((pose.x, pose.y, pose.yaw))
            self._covariances.append(np.array(odometry.covariance))

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the poses, (N, 3), and the covariances, (N, 3, 3)."""
        return np.array(self._poses), np.array(self._covariances)


def true_path(ride: Ride) -> np.ndarray:
    """Return x, y and yaw of the rear axle, (N, 3), of which a measured path is."""
    path = np.column_stack([ride.places, ride.yaw])
    return at_axle(path, KITTI_LEVER_M) if 'KITTI' in ride.name else path


def lorry(frame: Frame) -> Frame:
    """Draw the back of a lorry 8 m ahead: 2.5 m wide, from 0.5 to 3.5 m above the road."""
    focal, cx, cy, height = 718.856, 607.2, 185.2, 1.65
    left, right = (round(cx + focal * side / 8.0) for side in (-1.25, 1.25))
    top, bottom = (round(cy + focal * (height - at) / 8.0) for at in (3.5, 0.5))
    rng = np.random.default_rng(2)
    back = cv2.resize(rng.integers(60, 160, (8, 8)).astype(np.uint8), (
        right - left, bottom - max(top, 0)), interpolation=cv2.INTER_NEAREST)
    frame[max(top, 0):bottom, left:right] = back
    # Its shadow.
    frame[bottom:bottom + 40, left:right] //= 3
    return frame


def wet_night(frame: Frame) -> Frame:
    """Darken the image to a tenth, with the noise of a sensor at its limit."""
    rng = np.random.default_rng(int(frame[::16, ::16].sum()))
    dark = frame * 0.1 + rng.normal(0.0, 3.0, frame.shape)
    return np.clip(dark, 0, 255).astype(np.uint8)


def snow(frame: Frame) -> Frame:
    """Whiten the lower half, with a hundredth of its contrast and a grey level of noise."""
    half = len(frame) // 2
    rng = np.random.default_rng(int(frame[::16, ::16].sum()))
    below = frame[half:]
    white = 235 + 0.01 * (below.astype(np.float32) - 128) + rng.normal(0.0, 1.0, below.shape)
    below[:] = np.clip(white, 0, 255).astype(np.uint8)
    return frame


def crest(frames: int = 200) -> Ride:
    """Return a straight drive whose middle has the pitch of a crest of 500 m radius."""
    drive = plan_drive('crest', [Straight(frames / 10)], speed=15.0, camera=KITTI_CAMERA, seed=5)
    poses = drive.poses.copy()
    way = 1.5 * np.arange(len(poses))
    # On a road that bends down, the camera seems to look up by the slope about 5 m ahead.
    poses[:, 3] = MOUNTED - (5.0 / 500.0) * ((way > way[-1] / 3) & (way < 2 * way[-1] / 3))
    return streamed(replace(drive, poses=poses))


SPOILT: dict[str, Callable[[Frame], Frame]] = {
    'a lorry 8 m ahead': lorry, 'wet night': wet_night, 'snow': snow}


def _planned(
    name: str, plan: list[Straight | Turn], speed: float, camera: Camera = KITTI_CAMERA,
    rate_hz: float = 10.0, aside: float = 0.0, roll: float = 0.0, balances: bool = False,
    shaking: float = 0.0,
) -> Ride:
    drive = plan_drive(name, plan, rate_hz=rate_hz, speed=speed, camera=camera, seed=17)
    poses = drive.poses.copy()
    poses[:, 2] += aside
    poses[:, 3] += MOUNTED
    poses[:, 4] += roll
    if balances:
        across = np.hypot(*np.gradient(poses[:, :2], axis=0).T) * np.gradient(poses[:, 2])
        poses[:, 4] -= np.arctan(across * rate_hz ** 2 / 9.81)
    scatter = np.random.default_rng(17).normal(size=(len(poses), 3))
    poses[:, 2:] += shaking * scatter * (0.5, 1.0, 1.0)
    # The true path is that of the vehicle.
    return replace(streamed(replace(drive, poses=poses)), yaw=streamed(drive).yaw)
