# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Degradations of clips, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import count

from benchmarks.shared.clips import Clip
import cv2
import numpy as np
from phase_traj_ros.synthetic.camera import Camera, tilt
from phase_traj_ros.synthetic.degradations import (
    blur,
    fog,
    gain,
    kept_frames,
    night,
    rain,
    sensor_noise,
    vibration,
)

_FLICKER = 0.6, 1.4


@dataclass(frozen=True, slots=True)
class Condition:
    """One degradation of a clip."""

    name: str
    spoil: Callable[[Clip, int], Clip]
    """Takes a clip and a seed; returns another clip and leaves the first unchanged."""


def each_frame(
    spoil: Callable[..., np.ndarray], *, seeded: bool = False, **options: float,
) -> Callable[[Clip, int], Clip]:
    """Return the degradation of a clip that applies ``spoil`` to each frame."""
    def spoil_all(clip: Clip, seed: int) -> Clip:
        seeds = ({'seed': (seed, number)} if seeded else {} for number in count())
        return replace(clip, frames=[
            spoil(frame, **options, **drawn) for frame, drawn in zip(clip.frames, seeds)])

    return spoil_all


def _flicker(frame: np.ndarray, *, seed: tuple[int, int]) -> np.ndarray:
    return gain(frame, factor=np.random.default_rng(seed).uniform(*_FLICKER))


def _fog(clip: Clip, _: int, *, visibility: float) -> Clip:
    return replace(clip, frames=[
        fog(frame, visibility=visibility, camera=clip.camera) for frame in clip.frames])


def _drop(clip: Clip, seed: int, *, lost: float) -> Clip:
    kept = kept_frames(len(clip.frames), lost=lost, seed=seed)
    return replace(clip, frames=[clip.frames[index] for index in kept], yaw=clip.yaw[kept])


def _vibrate(clip: Clip, seed: int, *, degrees: float) -> Clip:
    poses = vibration(
        np.zeros((len(clip.frames), 5)), pitch_deg=degrees, roll_deg=degrees, seed=seed)
    return replace(clip, frames=[
        _tilted(frame, clip.camera, pitch, roll)
        for frame, (pitch, roll) in zip(clip.frames, poses[:, 3:])])


def _tilted(frame: np.ndarray, camera: Camera, pitch: float, roll: float) -> np.ndarray:
    """Return the image after a rotation of the camera: exact, except at the edges."""
    matrix = camera.matrix()
    return cv2.warpPerspective(
        frame, matrix @ tilt(pitch, roll).T @ np.linalg.inv(matrix), frame.shape[::-1],
        borderMode=cv2.BORDER_REFLECT)


CONDITIONS = (
    Condition('as they are', lambda clip, _: clip),
    *(Condition(f'noise, σ = {sigma}', each_frame(sensor_noise, seeded=True, sigma=sigma))
      for sigma in (10, 20, 30, 50)),
    *(Condition(f'blur, σ = {sigma} px', each_frame(blur, sigma=sigma)) for sigma in (1.5, 4)),
    Condition('overexposed, gain 1.8', each_frame(gain, factor=1.8)),
    Condition('gain 0.6–1.4 by chance', each_frame(_flicker, seeded=True)),
    *(Condition(f'night, {100 * exposure:g} % of the light',
                each_frame(night, seeded=True, exposure=exposure))
      for exposure in (0.06, 0.02)),
    *(Condition(f'fog, {visibility} m', partial(_fog, visibility=visibility))
      for visibility in (30, 10)),
    *(Condition(f'rain, {streaks} streaks', each_frame(rain, seeded=True, streaks=streaks))
      for streaks in (400, 2000)),
    *(Condition(f'vibration, {degrees}°', partial(_vibrate, degrees=degrees))
      for degrees in (0.2, 0.5)),
    *(Condition(f'{100 * lost:g} % of the frames lost', partial(_drop, lost=lost))
      for lost in (0.1, 0.3)),
)
