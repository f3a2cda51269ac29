# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the heading study: real clips, rendered drives, and overlays."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

from benchmarks.shared.clips import kitti, kitti_poses
import cv2
import numpy as np
from phase_traj_ros.synthetic import (
    Camera,
    Drive,
    KITTI_CAMERA,
    named_drive,
    plan_drive,
    pose_drive,
    poses_from_kitti,
    render_drive,
    Straight,
    Turn,
)

Frame = np.ndarray
#: Real clips, and the sequences whose poses full-length drives are rendered along.
REAL = ('00', '06')
FULL = ('00', '02', '08', '10')
_SPEED = 8.0

PLANS = {
    'U-turns': [
        Straight(3), Turn(180, 5, 4), Straight(3), Turn(-180, 6, 4), Straight(3)],
    'swerves': [
        Straight(3), Turn(35, 2.5, 6), Turn(-35, 2.5, 6), Straight(3), Turn(-42, 3, 6),
        Turn(42, 3, 6), Straight(3)],
    'gentle bends': [
        Straight(2), Turn(90, 12), Straight(2), Turn(-45, 8), Straight(2), Turn(-45, 6),
        Straight(2)],
    'roundabout': [
        Straight(3), Turn(-45, 1.8, 5), Turn(225, 8, 5), Turn(-90, 3, 5), Straight(4)],
    'stop and go': [
        Straight(2), Straight(4, 0), Straight(2), Turn(45, 2, 3), Straight(3, 0), Turn(45, 2, 3),
        Straight(3), Straight(3, 0), Turn(-90, 3, 4), Straight(2)],
    'sharp turns': [
        Straight(2), Turn(90, 1.6, 3), Straight(2), Turn(-90, 2, 3), Straight(1.5),
        Turn(-90, 2, 3), Straight(2), Turn(120, 3, 4), Straight(2)],
    'three lefts': [
        Straight(2.5), *[Turn(90, 3, 4.5), Straight(2.5)] * 3],
}
CAMERAS = {
    '1241×376, 82°, 10 Hz': (KITTI_CAMERA, 10.0),
    '320×240, 62°, 20 Hz': (Camera.with_field_of_view(320, 240, 62), 20.0),
    '320×240, 90°, 20 Hz': (Camera.with_field_of_view(320, 240, 90), 20.0),
    '640×480, 70°, 10 Hz': (Camera.with_field_of_view(640, 480, 70), 10.0),
    '640×400, 110°, 10 Hz': (Camera.with_field_of_view(640, 400, 110), 10.0),
    '1280×720, 30°, 10 Hz': (Camera.with_field_of_view(1280, 720, 30), 10.0),
}


@dataclass(frozen=True, eq=False)
class Ride:
    """Frames of one camera, and the truth: yaw in radians, positions in metres, REP 103 axes."""

    name: str
    camera: Camera
    stamps_ns: list[int]
    yaw: np.ndarray
    places: np.ndarray
    frames: Callable[[], Iterable[Frame]]

    def spoilt(self, name: str, spoil: Callable[[Frame], Frame]) -> Ride:
        """Return the ride with ``spoil`` applied to every frame."""
        return replace(
            self, name=f'{self.name}, {name}',
            frames=lambda: (spoil(frame.copy()) for frame in self.frames()))

    def kept(self) -> Ride:
        """Return the ride with its frames rendered once and kept in memory."""
        return replace(self, frames=lru_cache(lambda: list(self.frames())))

    def mirrored(self) -> Ride:
        """Return the mirrored ride."""
        camera = replace(self.camera, cx=self.camera.width - 1 - self.camera.cx)
        return Ride(
            f'{self.name}, mirrored', camera, self.stamps_ns, -self.yaw, self.places * (1, -1),
            lambda: (np.ascontiguousarray(cv2.flip(frame, 1)) for frame in self.frames()))


def real_rides() -> list[Ride]:
    """Return the real clips and their mirror images; empty if they are not available."""
    rides = []
    for sequence in REAL:
        there = kitti(sequence)
        if there is None:
            return []
        camera, taken, poses = there
        frames = [frame.image for frame in taken]
        ride = Ride(
            f'KITTI {sequence}', camera, [frame.stamp_ns for frame in taken], poses[:, 2],
            poses[:, :2], lambda frames=frames: frames)
        rides += [ride, ride.mirrored()]
    return rides


def rendered(name: str, camera: str) -> Ride:
    """Return the drive of a plan as seen by one of the cameras."""
    (lens, rate_hz) = CAMERAS[camera]
    drive = plan_drive(
        name, PLANS[name], rate_hz=rate_hz, speed=_SPEED, camera=lens, seed=17)
    return streamed(drive)


def named(name: str) -> Ride:
    """Return one of the package's named drives."""
    return streamed(named_drive(name))


def full_rides() -> list[Ride]:
    """Return the drives along whole KITTI sequences, with their pitch and roll, streamed."""
    return [
        streamed(pose_drive(f'along KITTI {sequence}', poses_from_kitti(matrices), seed=1))
        for sequence in FULL if (matrices := kitti_poses(sequence)) is not None]


def streamed(drive: Drive) -> Ride:
    """Return a drive as a ride whose frames are rendered on demand."""
    return Ride(
        drive.name, drive.camera, drive.stamps_ns.tolist(), np.unwrap(drive.poses[:, 2]),
        drive.poses[:, :2], lambda: render_drive(drive))


def clock(frame: Frame) -> Frame:
    """Draw a clock and a speed into the image."""
    (height, width), scale = frame.shape, len(frame) / 376
    thick = max(1, round(2 * scale))
    cv2.rectangle(frame, (0, 0), (round(0.35 * width), round(26 * scale)), 0, -1)
    cv2.putText(frame, '2026-03-01 12:34:56 CAM1', (5, round(20 * scale)),
                cv2.FONT_HERSHEY_SIMPLEX, 0.7 * scale, 255, thick)
    cv2.putText(frame, 'SPEED 50 km/h', (round(0.6 * width), round(0.95 * height)),
                cv2.FONT_HERSHEY_SIMPLEX, scale, 255, thick)
    return frame


def bonnet(frame: Frame) -> Frame:
    """Draw a shiny bonnet with reflections in the lower fifth of the image."""
    noise = np.random.default_rng(3).normal(size=frame.shape).astype(np.float32)
    shine = cv2.GaussianBlur(noise, (0, 0), 4)
    shine *= 40 / shine.std()
    rows, columns = np.indices(frame.shape) / np.reshape(frame.shape, (2, 1, 1))
    where = rows > 0.78 + 0.12 * (2 * columns - 1) ** 2
    frame[where] = np.clip(90 + shine, 0, 255).astype(np.uint8)[where]
    return frame


def borders(frame: Frame) -> Frame:
    """Blacken a margin at the top and on both sides."""
    height, width = (round(0.08 * side) for side in frame.shape)
    frame[:height] = 0
    frame[:, :width] = frame[:, -width:] = 0
    return frame


def dirt(frame: Frame) -> Frame:
    """Put 25 spots on the lens, up to a tenth of the width across."""
    rng = np.random.default_rng(5)
    height, width = frame.shape
    for _ in range(25):
        middle = round(rng.uniform(0, width)), round(rng.uniform(0, height))
        cv2.circle(frame, middle, round(rng.uniform(0.01, 0.05) * width),
                   round(rng.uniform(20, 120)), -1)
    return frame


OVERLAYS: dict[str, Callable[[Frame], Frame]] = {
    'clock and speed burnt in': clock, 'bonnet': bonnet, 'black borders': borders,
    'dirty lens': dirt}
