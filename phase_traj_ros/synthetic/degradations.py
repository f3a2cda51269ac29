# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Degradations of images: noise, blur, gain, night, fog, rain, vibration, lost frames, compression.

All are pure functions. Those of a frame take (height, width) uint8 and return the same. Random
parts depend on ``seed`` only, an integer or several: (drive, frame) seeds one frame of one drive.
"""

from collections.abc import Sequence
import io
from typing import TypeAlias

import cv2
import numpy as np
from phase_traj_ros.errors import needing
from phase_traj_ros.synthetic.arrays import as_bytes, Bytes, Floats, Ints, Singles
from phase_traj_ros.synthetic.camera import Camera, KITTI_CAMERA

Seed: TypeAlias = int | Sequence[int]


def _rounded(values: Singles) -> Bytes:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def sensor_noise(frame: Bytes, *, sigma: float, seed: Seed) -> Bytes:
    """Add Gaussian noise of standard deviation ``sigma`` grey levels to every pixel."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(frame.shape, np.float32)
    return _rounded(frame + np.float32(sigma) * noise)


def blur(frame: Bytes, *, sigma: float) -> Bytes:
    """Blur like a lens out of focus, by a Gaussian of standard deviation ``sigma`` pixels."""
    if sigma == 0:
        return frame.copy()
    return as_bytes(cv2.GaussianBlur(frame, (0, 0), sigma))


def gain(frame: Bytes, *, factor: float) -> Bytes:
    """Multiply the exposure by ``factor``; bright pixels are saturated."""
    return _rounded(frame * np.float32(factor))


def night(frame: Bytes, *, exposure: float = 0.06, electrons: float = 1000.0, seed: Seed) -> Bytes:
    """
    Darken to a share ``exposure`` of the light, and amplify the signal of the sensor.

    By day, ``electrons`` make white. At night there is shot noise and a read noise of 2 electrons,
    and the amplifier restores a third of the brightness.
    """
    rng = np.random.default_rng(seed)
    light = frame * (exposure * electrons / 255.0)
    counted = rng.poisson(light) + 2.0 * rng.standard_normal(frame.shape)
    return _rounded((counted * (255.0 / 3 / max(exposure * electrons, 1e-9))).astype(np.float32))


def fog(frame: Bytes, *, visibility: float, camera: Camera = KITTI_CAMERA) -> Bytes:
    """
    Fade to a light grey with distance, to 1 / e of the contrast at ``visibility`` metres.

    The distance is estimated from the row: below the horizon it is that of the ground, above it
    that of houses of 8 m height, and at most 40 m.
    """
    rows = np.arange(len(frame)) - camera.cy
    height = np.where(rows > 0, camera.above_ground, 8.0 - camera.above_ground)
    distance = np.minimum(camera.focal * height / np.maximum(np.abs(rows), 0.5), 40.0)
    clear = np.exp(-distance / max(visibility, 1e-9)).astype(np.float32)[:, None]
    return _rounded(frame * clear + np.float32(190.0) * (1 - clear))


def rain(frame: Bytes, *, streaks: int = 400, seed: Seed) -> Bytes:
    """Draw bright, slightly slanting streaks of rain, which differ from frame to frame."""
    rng = np.random.default_rng(seed)
    (height, width) = frame.shape
    overlay = np.zeros((height, width), np.uint8)
    slant = rng.normal(0.0, 0.08)
    tops = rng.uniform((0, -0.1 * height), (width, height), (streaks, 2))
    lengths = rng.uniform(0.03, 0.16, streaks) * height
    for ((x, y), length, tone) in zip(tops, lengths, rng.uniform(25, 90, streaks)):
        end = (round(x + slant * length), round(y + length))
        cv2.line(overlay, (round(x), round(y)), end, tone, 1, cv2.LINE_AA)
    return as_bytes(cv2.add(frame, cv2.GaussianBlur(overlay, (3, 3), 0.7)))


def vibration(
    poses: Floats, *, pitch_deg: float = 0.2, roll_deg: float = 0.2, seed: Seed,
) -> Floats:
    """
    Shake the camera: return the poses (N, 5) with random pitch and roll added.

    Both are Gaussian with the given standard deviations, in degrees, independent in every frame.
    """
    rng = np.random.default_rng(seed)
    shaken = poses.copy()
    shaken[:, 3:] += np.radians((pitch_deg, roll_deg)) * rng.standard_normal((len(poses), 2))
    return shaken


def kept_frames(count: int, *, lost: float, seed: Seed) -> Ints:
    """
    Return the indices of the frames that remain if each is lost with probability ``lost``.

    The first one always remains; `Drive.take` selects them from a drive.
    """
    kept = np.random.default_rng(seed).random(count) >= lost
    kept[:1] = True
    return np.flatnonzero(kept)


def encoded(
    frames: Sequence[Bytes], *, rate_factor: int, rate_hz: int = 10, preset: str = 'medium',
) -> list[Bytes]:
    """
    Return frames as a film of H.264 shows them, which x264 encodes in the same way every time.

    ``rate_factor`` is its constant rate factor, from 0 to 51: more of it compresses more, and 23
    is common. The frames are of one size. The encoder needs even sides, so an odd last row or
    column is cut off.

    Raises
    ------
    MissingDependencyError
        PyAV is not installed.

    """
    with needing('compressed films need PyAV', 'install phase_traj_ros[video]'):
        import av
    (height, width) = (side // 2 * 2 for side in frames[0].shape)
    file = io.BytesIO()
    with av.open(file, 'w', format='matroska') as film:
        # With several threads, or the instructions of newer processors, runs of x264 differ.
        stream = film.add_stream('libx264', rate=rate_hz, options={
            'crf': str(rate_factor), 'preset': preset, 'threads': '1',
            'x264-params': 'asm=sse2'})
        (stream.width, stream.height, stream.pix_fmt) = (width, height, 'yuv420p')
        for frame in frames:
            grey = np.ascontiguousarray(frame[:height, :width])
            picture = av.VideoFrame.from_ndarray(grey, 'gray').reformat(format='yuv420p')
            film.mux(stream.encode(picture))
        film.mux(stream.encode())
    file.seek(0)
    with av.open(file, 'r') as shown:
        return [as_bytes(each.to_ndarray(format='gray')) for each in shown.decode(video=0)]
