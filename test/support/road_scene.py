# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A road below a camera, drawn exactly, and drives along it."""

from functools import lru_cache
import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.lens_family import OneNumberLens
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion

PINHOLE = CameraModel.pinhole((240, 640), 370.0)
FISHEYE = CameraModel.of_lens(OneNumberLens(220.0, 0.0), (400, 640))
NOISE = cv2.GaussianBlur(
    np.random.default_rng(0).normal(size=(4096, 1024)).astype(np.float32), (0, 0), 1.5)
NOISE = np.clip(110 + 14 * NOISE / NOISE.std(), 0, 255).astype(np.uint8)
PER_HEIGHT = 40.0
LEVEL = np.eye(3)
SURE = Horizon(pitch_deviation=0.0)


class Road:
    """Pictures of a plane one unit below a camera; heights and radians, REP 103."""

    def __init__(self, camera, pitch=0.0):
        self.shape = camera.shape
        rows, columns = np.indices(camera.shape, np.float64)
        # The directions of the pixels, by looking them up the other way round.
        if camera is not FISHEYE:
            x, y = (columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
            self.rays = np.stack([x, y, np.ones_like(x)], axis=-1)
        else:
            angle = np.hypot(columns - camera.cx, rows - camera.cy) / camera.fx
            along = np.arctan2(rows - camera.cy, columns - camera.cx)
            self.rays = np.stack([
                np.sin(angle) * np.cos(along), np.sin(angle) * np.sin(along), np.cos(angle)],
                axis=-1)
        self.pitch = pitch
        # Most drives keep the camera at one pitch and roll.
        self._plane = lru_cache(1)(self._seen_plane)

    def _seen_plane(self, pitch, roll):
        """Return the coordinates of the plane in each pixel, and where they are below."""
        level = self.rays @ Horizon(self.pitch + pitch, roll).levelling().T
        below = level[..., 1] > 0.02
        down = np.where(below, level[..., 1], 1.0)
        return level[..., 2] / down, -level[..., 0] / down, below

    def seen(self, x, y=0.0, yaw=0.0, pitch=0.0, roll=0.0):
        ahead, left, below = self._plane(pitch, roll)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        way = x + cosine * ahead - sine * left
        aside = y + sine * ahead + cosine * left
        frame = cv2.remap(
            NOISE, (512 + PER_HEIGHT * aside).astype(np.float32),
            (PER_HEIGHT * way + 100).astype(np.float32), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_WRAP)
        frame[~below] = 90
        return frame


def motion(yaw=0.0, pitch=0.0, *, slope=0.0, passing=0.05):
    return CameraMotion(
        yaw, pitch, 0.0, FocusOfExpansion(slope=slope, slope_variance=0.004 ** 2), 100.0, 1.0,
        1e-8, abs(passing), near=passing)


def drive(camera, step, *, pitch=0.0, told=None, frames=12, spoil=None, **kwargs):
    road = Road(camera, pitch)
    horizon = Horizon() if told is None else Horizon(told, pitch_deviation=0.0)
    meter = RoadMeter(camera, horizon, **kwargs)
    travels = []
    for index in range(frames):
        frame = road.seen(index * step)
        if spoil is not None:
            spoil(index, frame)
        if index == 0:
            meter.start(frame)
            continue
        travels.append(meter.update(
            frame, 0.1, motion(slope=-math.tan(pitch), passing=0.1 * step)))
    return travels


def with_copies(roads):
    """Return pictures of the road in which a film copies most of it, eight times at most."""
    rng = np.random.default_rng(1)
    for index, road in enumerate(roads):
        if index % 8 == 0:
            copied = cv2.GaussianBlur(rng.normal(size=PINHOLE.shape), (0, 0), 2.0)
            copied *= 10.0 / copied.std()
        yield (128.0 + copied + 0.06 * (road - 128.0)).astype(np.uint8)
