# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The camera's rotation from the displacements of blocks on the cylinder, whatever their distance.

A point at the azimuth t (to the right) and the slope y (downwards), at the horizontal distance d,
moves on the cylinder, when the camera turns by a small rotation and moves on by s, by

    u = yaw + y (pitch sin t + roll cos t)         + q sin(t - b)
    w = (1 + y**2) (pitch cos t - roll sin t)      + q (y cos(t - b) - c),    q = s / d >= 0.

u is to the right, w downwards, both in radians (w as a slope). Yaw is positive to the left (REP
103); pitch and roll are rotations about the picture's x (right) and z (forward) axes. b is the
azimuth of the direction of travel, c its slope. The first terms do not depend on the distance and
the last ones lie, for each point, along one line; so the part of (u, w) across that line tells
the rotation free of all distances. This is the differential form of the epipolar constraint
(Longuet-Higgins and Prazdny, "The interpretation of a moving retinal image", 1980). On top of it
come that nothing passes backwards (q >= 0), that q is not boundless (so that a point in the
direction of travel itself, which hardly moves whatever its distance, tells u and w both), and
that the direction of travel of a vehicle is never far from straight ahead.
"""

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray

_ITERATIONS = 4
# Standard deviation of q, as a share of which the displacements' own deviation is given below.
_NEARNESS = 0.1
# Displacements farther from the model than so many deviations speak against it.
_OUTLIER = 3.0
# The direction of travel: how far from straight ahead (standard deviation, radians), and how
# long it stays what it was (seconds).
_COURSE, _SLOPE, _MEMORY = math.radians(3.0), math.radians(2.0), 1.0
# Half of the squares of a normal distribution are below this, in variances.
_MEDIAN = 0.455
_YAW, _PITCH, _ROLL, _B, _C, _ERROR = range(6)


@dataclass(frozen=True, slots=True)
class Travel:
    """Direction of travel in the camera's view: azimuth and slope, with their variances."""

    course: float = 0.0
    slope: float = 0.0
    course_variance: float = _COURSE ** 2
    slope_variance: float = _SLOPE ** 2

    def after(self, interval: float) -> 'Travel':
        """Return what is known ``interval`` seconds later: it tends to straight ahead."""
        kept = math.exp(-interval / _MEMORY)
        share = kept * kept
        return Travel(
            kept * self.course, kept * self.slope,
            share * self.course_variance + (1.0 - share) * _COURSE ** 2,
            share * self.slope_variance + (1.0 - share) * _SLOPE ** 2)


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """How the camera has turned between two frames, in radians, and how many blocks say so."""

    yaw: float
    """Left positive."""
    pitch: float
    roll: float
    travel: Travel
    agreeing: float
    """Sum of the weights of the blocks that agree with this motion."""
    agreement: float
    """Their share of all weights, 0 to 1."""
    yaw_variance: float
    """Of the yaw, in square radians, from how much the agreeing blocks scatter."""
    passing: float
    """Median of the blocks' q: the way of the camera over their distance."""


class MotionFit:
    """Fits the model of this module to the displacements of fixed blocks, by least squares."""

    def __init__(
        self, azimuths: NDArray[np.float64], slopes: NDArray[np.float64], *, deviation: float,
    ) -> None:
        """
        Take the blocks' azimuths and slopes, (N,) each, in radians.

        ``deviation`` is that of a block's displacement, in radians.
        """
        self._azimuths = azimuths
        self._slopes = slopes
        self._deviation = deviation
        self._least = (deviation / _NEARNESS) ** 2

    def __call__(
        self, u: NDArray[np.float64], w: NDArray[np.float64], weight: NDArray[np.float64],
        travel: Travel,
    ) -> CameraMotion | None:
        """
        Return the motion that explains the displacements (N,) best, or None without any.

        ``travel`` is what is known of the direction of travel beforehand.
        """
        used = np.flatnonzero(weight > 0.0)
        if len(used) <= _C:
            return None
        u, w, weight = u[used], w[used], weight[used]
        # The displacement is that of the point half-way: so it is the same in both directions.
        azimuth = self._azimuths[used] + u / 2
        y = self._slopes[used] + w / 2
        shift = np.stack([u, w])
        # What each unknown does to each point, (6, 3, N): across, downwards, and along the line
        # that its distance moves it on. The last row is the error that the unknowns leave.
        known = np.zeros((_ERROR + 1, 3, len(used)))
        known[_YAW, 0] = -1.0
        sine, cosine, bulge = np.sin(azimuth), np.cos(azimuth), 1.0 + y * y
        known[_PITCH, :2] = -y * sine, -bulge * cosine
        known[_ROLL, :2] = -y * cosine, bulge * sine
        rotations = known[:_B, :2].reshape(_B, -1)
        along, factor = np.empty_like(shift), np.empty((3, len(used)))
        variance = self._deviation ** 2
        prior = np.array([np.partition(u, len(u) // 2)[len(u) // 2], 0.0, 0.0,
                          travel.course, travel.slope])
        trust = variance * np.array(
            [0.0, 0.0, 0.0, 1 / travel.course_variance, 1 / travel.slope_variance])
        state = prior.copy()
        for _ in range(_ITERATIONS):
            apart = azimuth - state[_B]
            ahead = np.cos(apart)
            np.sin(apart, out=along[0])
            np.subtract(y * ahead, state[_C], out=along[1])
            rest = shift + (state[:_B] @ rotations).reshape(shift.shape)
            squared = (along * along).sum(axis=0) + self._least
            near = (rest * along).sum(axis=0) / squared
            forwards = near > 0.0
            near *= forwards
            known[_ERROR, :2] = rest - near * along
            error = (known[_ERROR, :2] * rest).sum(axis=0)
            # Cauchy's weights: what is far off, such as other traffic, hardly counts.
            factor[:2] = robust = weight / (1.0 + error / variance)
            # What lies along the line tells the distance, and so nothing else.
            np.divide(robust * forwards, -squared, out=factor[2])
            known[_B, :2] = near * ahead, -near * y * along[0]
            known[_C, 1] = near
            np.einsum('ijk,jk->ik', known[:_ERROR, :2], along, out=known[:_ERROR, 2])
            normal = (known[:_ERROR] * factor).reshape(_ERROR, -1) @ known.reshape(
                _ERROR + 1, -1).T
            gradient = normal[:, _ERROR] + trust * (state - prior)
            # OpenCV's, as LAPACK's may wake threads: for so little they take as long as the rest.
            solvable, inverse = cv2.invert(normal[:, :_ERROR] + np.diag(trust))
            if not solvable:
                return None
            state -= inverse @ gradient
        covariance = inverse * variance
        agreeing = float(weight[error < (_OUTLIER * self._deviation) ** 2].sum())
        # Each block leaves one residual, as its depth takes up the other one. The median of them
        # gives the deviation, whatever the outliers do.
        spread = float(np.median(error)) / (_MEDIAN * variance)
        return CameraMotion(
            yaw=float(state[_YAW]), pitch=float(state[_PITCH]), roll=float(state[_ROLL]),
            travel=Travel(float(state[_B]), float(state[_C]),
                          float(covariance[_B, _B]), float(covariance[_C, _C])),
            agreeing=agreeing, agreement=agreeing / float(weight.sum()),
            yaw_variance=float(covariance[_YAW, _YAW]) * spread, passing=float(np.median(near)))
