# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Distorted cameras that turn in front of a far scene."""

from functools import cache
import math

from far_scene import barrel, BARREL_COEFFICIENTS, fisheye, FISHEYE_COEFFICIENTS, render
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel, Distortion

TENTH = 100_000_000
BARREL = CameraModel(
    width=480, height=360, fx=250.0, fy=250.0, cx=240.0, cy=178.0, distortion=Distortion.BROWN,
    coefficients=BARREL_COEFFICIENTS)
FISHEYE = CameraModel(
    width=480, height=360, fx=157.0, fy=157.0, cx=238.0, cy=181.0, distortion=Distortion.FISHEYE,
    coefficients=FISHEYE_COEFFICIENTS)
# Steered as vehicles are: a yaw rate that jumps is not believed.
STEPS = (0.0, 0.5, 1.2, 2.0, 2.7, 3.0, 2.7, 2.0, 1.0, 0.0, -0.8, -1.5, -2.0, -1.5)
HEADINGS = tuple(np.cumsum(STEPS))


@cache
def turning(name):
    """Return the camera and the frames, of which the heading is HEADINGS in degrees."""
    camera, radius = {'barrel': (BARREL, barrel), 'fisheye': (FISHEYE, fisheye)}[name]
    return camera, [
        render(camera, radius, math.radians(heading)) for heading in HEADINGS]


def follow(estimator, frames):
    """Return the heading in degrees after each of the frames."""
    headings = []
    for index, frame in enumerate(frames):
        measured = estimator.camera.measure(frame, 0.1)
        if index:
            estimator.add(measured, index * TENTH, 0.1)
        else:
            estimator.start(0)
        headings.append(math.degrees(estimator.tracker.heading))
    return np.array(headings)
