# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Overlays fixed to the camera: black bars, a bonnet, burnt-in text, drops on the windscreen.

All are pure functions of a frame, (height, width) uint8, and return the same. Random parts
depend on ``seed`` only: the same seed puts the same overlay on every frame of a drive.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import Bytes, Singles

_BLURRED = 8


def black_bars(frame: Bytes, *, sides: float = 0.0, ends: float = 0.0) -> Bytes:
    """Blacken a share ``sides`` of the width at each side, ``ends`` of the height at each end."""
    height, width = frame.shape
    down, across = round(ends * height), round(sides * width)
    barred = np.zeros_like(frame)
    inner = slice(down, height - down), slice(across, width - across)
    barred[inner] = frame[inner]
    return barred


def bonnet(frame: Bytes, *, height: float = 0.2, seed: int = 0) -> Bytes:
    """Draw a dented bonnet that hides a share ``height`` of the frame, measured in the middle."""
    (cover, metal) = _metal(frame.shape, height, seed)
    return _mixed(frame, metal, cover)


def burnt_in_text(frame: Bytes, text: str) -> Bytes:
    """Write ``text`` in white on a black box at the top left, like a recorder."""
    written, scale = frame.copy(), frame.shape[1] / 1241
    thick = max(round(2 * scale), 1)
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.8 * scale, thick)
    edge = max(round(4 * scale), 1)
    cv2.rectangle(written, (0, 0), (width + 2 * edge, height + below + 2 * edge), (0,), -1)
    cv2.putText(written, text, (edge, height + edge), cv2.FONT_HERSHEY_SIMPLEX, 0.8 * scale,
                (255,), thick, cv2.LINE_AA)
    return written


def drops(
    frame: Bytes, *, count: int = 60, size: float = 0.015, softness: float = 0.3, seed: int = 0,
) -> Bytes:
    """
    Draw drops of water on the windscreen.

    A drop shows the scene upside down, strongly blurred, and is brighter at its bottom.

    Parameters
    ----------
    frame
        The frame without drops.
    count
        Number of drops.
    size
        Mean radius, as a share of the width.
    softness
        Width of a drop's edge as a share of its radius: near 0 in focus, 1 far out of focus.
    seed
        Seed of positions, sizes and shades.

    """
    (cover, shade) = _water(frame.shape, count, size, softness, seed)
    height, width = frame.shape
    small = cv2.resize(
        frame[::-1], (max(width // _BLURRED, 1), max(height // _BLURRED, 1)),
        interpolation=cv2.INTER_AREA)
    blurred = cv2.GaussianBlur(small, (0, 0), max(0.03 * width / _BLURRED, 0.5))
    return _mixed(frame, cv2.resize(blurred, (width, height)) + shade, cover)


def _mixed(frame: Bytes, over: Singles, cover: Singles) -> Bytes:
    mixed = frame + (over - frame) * cover
    return np.clip(np.rint(mixed), 0, 255).astype(np.uint8)


@lru_cache(maxsize=4)
def _metal(shape: tuple[int, int], height: float, seed: int) -> tuple[Singles, Singles]:
    noise = np.random.default_rng(seed).standard_normal(shape, np.float32)
    shine = cv2.GaussianBlur(noise, (0, 0), max(shape[1] / 300, 0.5))
    metal = np.clip(70 + 25 * shine / shine.std(), 0, 255).astype(np.float32)
    across = np.linspace(-1, 1, shape[1])
    edge = shape[0] * (1 - height * (1 - 0.4 * across * across))
    cover = np.clip(np.arange(shape[0])[:, None] - edge, 0, 1).astype(np.float32)
    return cover, metal


@lru_cache(maxsize=4)
def _water(
    shape: tuple[int, int], count: int, size: float, softness: float, seed: int,
) -> tuple[Singles, Singles]:
    """Return the weight of the drops in each pixel, and their brightness relative to the scene."""
    rng = np.random.default_rng(seed)
    height, width = shape
    cover, shade = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for _ in range(count):
        across = max(width * size * rng.uniform(0.4, 1.6), 1.0)
        down = across * rng.uniform(0.8, 1.5)
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        rows = slice(max(int(y - 3 * down), 0), int(y + 3 * down) + 1)
        columns = slice(max(int(x - 3 * across), 0), int(x + 3 * across) + 1)
        below = (np.arange(height)[rows, None] - y) / down
        radius = np.hypot(below, (np.arange(width)[None, columns] - x) / across)
        edge = max(softness, 1 / across)
        water = np.clip((1 - radius) / edge + 0.5, 0, 1) * rng.uniform(0.7, 1)
        light = rng.uniform(20, 60) * below + rng.uniform(-30, 30) + 0 * radius
        nearer = water > cover[rows, columns]
        cover[rows, columns][nearer] = water[nearer]
        shade[rows, columns][nearer] = light[nearer]
    return cover, shade
