# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the measurements: real clips if available, rendered drives otherwise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
import os
from pathlib import Path

import cv2
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.io.sources.folder import FolderSource
from phase_traj_ros.synthetic import Camera, KITTI_CAMERA, named_drive, poses_from_kitti, render

#: Frames of the drives below during a turn.
_KITTI_TURN, _DEMO_TURN = 80, 20
_FULL_HD = Camera.with_field_of_view(1920, 1080, 70)


@dataclass(frozen=True, slots=True)
class Clip:
    """Frames of one camera, with the ground truth if it is known."""

    name: str
    camera: Camera
    frames: list[np.ndarray]
    """Each (H, W) uint8."""
    yaw: np.ndarray
    """The camera's yaw at each frame, (N,) radians, positive to the left."""

    @property
    def shape(self) -> tuple[int, int]:
        """Return (H, W)."""
        return self.camera.height, self.camera.width

    def there_and_back(self, count: int) -> Iterator[np.ndarray]:
        """Yield ``count`` frames, alternately forwards and backwards: neighbours stay close."""
        cycle = [*range(len(self.frames)), *range(len(self.frames) - 2, 0, -1)]
        for number in range(count):
            yield self.frames[cycle[number % len(cycle)]]


#: How far KITTI's cameras are ahead of the rear axle, in metres, by the drawing of its vehicle;
#: over 103 stretches of 15 s of sequences 00, 02, 06, 08 and 10, the poses say 1.0 m.
KITTI_LEVER_M = 1.03


def at_axle(poses: np.ndarray, lever: float) -> np.ndarray:
    """Return poses x, y, yaw, ..., (N, 3) or more, of the axle that is ``lever`` m behind."""
    moved = poses.copy()
    moved[:, :2] -= lever * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    return moved


def kitti_root() -> Path | None:
    """Return the folder of the KITTI clips, or None if there is none."""
    beside = Path(__file__).resolve().parents[3] / 'shared' / 'kitti'
    root = Path(os.environ.get('PHASE_TRAJ_KITTI', beside))
    return root if (root / '00' / 'image_0').is_dir() else None


def kitti_poses(sequence: str) -> np.ndarray | None:
    """Return the poses of a whole sequence, (N, 12), or None if they are not available."""
    root = kitti_root()
    file = root / 'poses' / f'{sequence}.txt' if root else None
    return np.loadtxt(file) if file and file.is_file() else None


def kitti(sequence: str) -> tuple[Camera, list[StampedFrame], np.ndarray] | None:
    """
    Return a clip of the KITTI odometry benchmark; None if it is not available.

    That is its calibrated camera, to render with, its frames, and their poses x, y, yaw, pitch and
    roll, (N, 5).
    """
    root = kitti_root()
    if root is None:
        return None
    source = FolderSource(root / sequence / 'image_0')
    model = source.camera(rectified=True)
    camera = replace(
        KITTI_CAMERA, width=model.width, height=model.height, focal=model.fx, cx=model.cx,
        cy=model.cy)
    poses = poses_from_kitti(np.loadtxt(root / sequence / 'poses.txt'))
    return camera, list(source), poses


def on_disk(file: Path, shape: tuple[int, int, int], frames: Iterable[np.ndarray]) -> np.ndarray:
    """Return frames of this shape in all, kept in a file: they are made only if it is missing."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix('.part')
        kept = np.lib.format.open_memmap(part, 'w+', np.uint8, shape)
        for number, frame in enumerate(frames):
            kept[number] = frame
        kept.flush()
        part.replace(file)
    return np.load(file, mmap_mode='r')


def model_of(camera: Camera) -> CameraModel:
    """Return the calibration of a camera."""
    return CameraModel(
        width=camera.width, height=camera.height, fx=camera.focal, fy=camera.focal, cx=camera.cx,
        cy=camera.cy,
        distortion=Distortion.NONE if camera.fisheye is None else Distortion.FISHEYE,
        coefficients=camera.fisheye or ())


def kitti_clip(sequence: str, *, first: int = 0, count: int | None = None) -> Clip | None:
    """Return a part of a clip of the KITTI odometry benchmark; None if it is not available."""
    there = kitti(sequence)
    if there is None:
        return None
    camera, frames, poses = there
    chosen = slice(first, None if count is None else first + count)
    return Clip(
        f'KITTI {sequence}', camera, [frame.image for frame in frames[chosen]], poses[chosen, 2])


def rendered_clip(camera: Camera, *, first: int = _DEMO_TURN, count: int) -> Clip:
    """Return a part of the demo's drive as seen by ``camera``."""
    drive = replace(named_drive('demo'), camera=camera)
    scene = drive.build_scene()
    stretch = range(first, first + count)
    return Clip(
        'rendered', camera, [render(scene, camera, drive.pose(index)) for index in stretch],
        drive.poses[stretch.start:stretch.stop, 2])


def usual_clips(count: int) -> tuple[Clip, Clip, Clip]:
    """Return clips of 376 x 1241, 375 x 1242 and 1080 x 1920, straight ahead and into a turn."""
    real = kitti_clip('00', first=_KITTI_TURN, count=count)
    return (
        real or rendered_clip(KITTI_CAMERA, count=count),
        rendered_clip(replace(KITTI_CAMERA, width=1242, height=375), count=count),
        rendered_clip(_FULL_HD, count=count))


def mirrored(clip: Clip) -> Clip:
    """Return the mirrored clip: left and right are swapped."""
    camera = replace(clip.camera, cx=clip.camera.width - 1 - clip.camera.cx)
    frames = [np.ascontiguousarray(cv2.flip(frame, 1)) for frame in clip.frames]
    return Clip(f'{clip.name}, mirrored', camera, frames, -clip.yaw)


def paste(frame: np.ndarray, patch: np.ndarray, top: int, left: int) -> None:
    """Draw the part of a patch that is within the width of the frame, in place."""
    begin, end = max(left, 0), min(left + patch.shape[1], frame.shape[1])
    if begin < end:
        frame[top:top + patch.shape[0], begin:end] = patch[:, begin - left:end - left]
