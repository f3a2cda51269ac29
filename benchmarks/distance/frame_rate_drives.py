# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the study of frame rates: drives, and the ways in which a camera films them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
import zlib

from benchmarks.shared.clips import kitti_poses, on_disk
import numpy as np
from phase_traj_ros.synthetic import (
    Camera,
    Drive,
    plan_drive,
    pose_drive,
    poses_from_kitti,
    render_drive,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.degradations import night, sensor_noise

#: Every drive is rendered at this rate, of which all other rates are a part.
BASE_HZ = 120
# Standard deviation of the sensor's noise in grey levels: no two exposures are equal.
_NOISE = 1.0
_PITCH = np.radians(1.0)
_wide = Camera.with_field_of_view
_CAR = _wide(640, 240, 85)
_ROBOT = _wide(320, 180, 80, above_ground=0.4)
_HANDHELD = _wide(640, 240, 85, above_ground=1.5)


@dataclass(frozen=True)
class Filmed:
    """What a camera delivers: which exposures, of the drive at ``BASE_HZ``, with which stamps."""

    exposures: np.ndarray
    """(N,) their numbers; equal ones are one picture that is repeated."""
    stamps_ns: np.ndarray
    """(N,) nanoseconds, increasing."""


def steady(rate_hz: int) -> Callable[[int], Filmed]:
    """Return a camera of this rate, which divides ``BASE_HZ``."""
    return lambda count: _at(np.arange(0, count, BASE_HZ // rate_hz), rate_hz)


def converted(rate_hz: int, taken_hz: int) -> Callable[[int], Filmed]:
    """Return a film of one rate made of one of a lower rate: some of its pictures are repeated."""
    def film(count: int) -> Filmed:
        shown = np.arange(count * rate_hz // BASE_HZ)
        return _at(shown * taken_hz // rate_hz * (BASE_HZ // taken_hz), rate_hz)
    return film


def losing(rate_hz: int, share: float) -> Callable[[int], Filmed]:
    """Return a camera that loses this share of its frames at random; the stamps show it."""
    def film(count: int) -> Filmed:
        whole = steady(rate_hz)(count)
        kept = np.random.default_rng(3).random(len(whole.exposures)) >= share
        kept[0] = True
        return Filmed(whole.exposures[kept], whole.stamps_ns[kept])
    return film


def jittering(rate_hz: int, share: float) -> Callable[[int], Filmed]:
    """Return a camera whose stamps have an error, in shares of the interval (normal)."""
    def error(count: int) -> np.ndarray:
        return np.clip(np.random.default_rng(4).normal(0.0, share, count), -0.45, 0.45)
    return _misstamped(rate_hz, error)


def delaying(rate_hz: int, share: float) -> Callable[[int], Filmed]:
    """Return a camera that stamps this share of its frames up to 0.7 of an interval late."""
    def error(count: int) -> np.ndarray:
        rng = np.random.default_rng(5)
        return rng.uniform(0.0, 0.7, count) * (rng.random(count) < share)
    return _misstamped(rate_hz, error)


def _misstamped(rate_hz: int, error: Callable[[int], np.ndarray]) -> Callable[[int], Filmed]:
    """Return a camera whose stamps have errors, (N,) for N frames, in shares of the interval."""
    def film(count: int) -> Filmed:
        whole = steady(rate_hz)(count)
        off = error(len(whole.stamps_ns)) * 1e9 / rate_hz
        return Filmed(whole.exposures, whole.stamps_ns + off.astype(np.int64))
    return film


FILMED: dict[str, Callable[[int], Filmed]] = {
    **{f'{rate} Hz': steady(rate) for rate in (5, 10, 15, 30, 60, 120)},
    '30 Hz, doubled': converted(30, 15),
    '30 Hz, tripled': converted(30, 10),
    '30 Hz, every fifth repeated': converted(30, 24),
    '30 Hz, a fifth lost': losing(30, 0.2),
    '30 Hz, jitter of a tenth': jittering(30, 0.1),
    '30 Hz, a third stamped late': delaying(30, 1 / 3),
}


def _planned(
    plan: list[Straight | Turn], speed: float, camera: Camera = _CAR,
) -> Callable[[], Drive]:
    return lambda: plan_drive('', plan, rate_hz=BASE_HZ, speed=speed, camera=camera, seed=17)


def _along_kitti() -> Drive:
    """Return the first 15 s of sequence 00 as driven, at a steady rotation between its poses."""
    matrices = kitti_poses('00')
    if matrices is None:
        raise SystemExit('the drive along KITTI 00 needs its poses: set PHASE_TRAJ_KITTI')
    poses = poses_from_kitti(matrices)[:151, :3]
    times = np.arange(15 * BASE_HZ + 1) / BASE_HZ
    between = [np.interp(times, np.arange(len(poses)) / 10.0, column) for column in poses.T]
    return pose_drive('', np.stack(between, axis=1), rate_hz=BASE_HZ, seed=1)


_walk = _planned([Straight(4), Turn(90, 6), Straight(4)], 1.4, _HANDHELD)
_AT_NIGHT = 'walk at night, 1.4 m/s'

DRIVES: dict[str, Callable[[], Drive]] = {
    'block, 9 m/s': _planned(
        [Straight(2), Turn(90, 3.5, 5), Straight(2), Turn(-90, 3, 5), Straight(2)], 9.0),
    'walk, 1.4 m/s': _walk,
    'slow robot, 0.3 m/s': _planned([Straight(5), Turn(-90, 30), Straight(5)], 0.3, _ROBOT),
    'robot on the spot': _planned(
        [Straight(8), Straight(1, 0), Turn(180, 4, 0), Straight(8)], 0.5, _ROBOT),
    'out of a parking bay': _planned(
        [Straight(1.5, 0), Turn(-90, 8, -1.5), Straight(1.5, 0), Straight(5)], 4.0),
    'motorway, 25 m/s': _planned([Straight(4), Turn(20, 6), Straight(2)], 25.0),
    'motorway, 35 m/s': _planned([Straight(4), Turn(20, 6), Straight(2)], 35.0),
    'stop and go': _planned([
        Straight(2), Straight(2, 0), Straight(3), Turn(90, 4, 4), Straight(2, 0), Straight(3)],
        7.0),
    'along KITTI 00': _along_kitti,
    _AT_NIGHT: _walk,
}


class Material:
    """The exposures of one drive, rendered once and kept on the disk."""

    def __init__(self, name: str, folder: Path) -> None:
        """Render the drive with this name, or take it from the folder."""
        drive = DRIVES[name]()
        poses = drive.poses.copy()
        poses[:, 3] += _PITCH
        self.drive = replace(drive, name=name, poses=poses)
        camera = drive.camera
        self._at_night = name == _AT_NIGHT
        key = zlib.crc32(poses.tobytes() + repr((camera, self._at_night)).encode())
        self._kept = on_disk(
            folder / f'{key:08x}.npy', (len(drive), camera.height, camera.width),
            self._exposures())

    def _exposures(self) -> Iterator[np.ndarray]:
        for number, frame in enumerate(render_drive(self.drive)):
            yield (night(frame, seed=number) if self._at_night
                   else sensor_noise(frame, sigma=_NOISE, seed=number))

    def frames(self, filmed: Filmed) -> Iterator[np.ndarray]:
        """Yield the frames, (H, W) uint8."""
        for number in filmed.exposures:
            yield np.array(self._kept[number])


def _at(exposures: np.ndarray, rate_hz: int) -> Filmed:
    return Filmed(exposures, 10**18 + np.rint(
        np.arange(len(exposures)) * (1e9 / rate_hz)).astype(np.int64))
