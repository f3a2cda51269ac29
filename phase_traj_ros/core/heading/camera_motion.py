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
_YAW, _PITCH, _ROLL, _B, _C = range(5)


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
        sine, cosine, bulge = np.sin(azimuth), np.cos(azimuth), 1.0 + y * y
        known = np.zeros((5, 2, len(used)))
        known[_YAW, 0] = -1.0
        known[_PITCH] = -y * sine, -bulge * cosine
        known[_ROLL] = -y * cosine, bulge * sine
        prior = np.array([np.partition(u, len(u) // 2)[len(u) // 2], 0.0, 0.0,
                          travel.course, travel.slope])
        trust = np.array([0.0, 0.0, 0.0, 1 / travel.course_variance, 1 / travel.slope_variance])
        trust *= self._deviation ** 2
        state = prior.copy()
        for _ in range(_ITERATIONS):
            along_u = sine * math.cos(state[_B]) - cosine * math.sin(state[_B])
            ahead = cosine * math.cos(state[_B]) + sine * math.sin(state[_B])
            along_w = y * ahead - state[_C]
            rest_u = u + np.tensordot(state[:_B], known[:_B, 0], 1)
            rest_w = w + np.tensordot(state[:_B], known[:_B, 1], 1)
            squared = along_u * along_u + along_w * along_w + self._least
            near = (rest_u * along_u + rest_w * along_w) / squared
            forwards = near > 0.0
            near *= forwards
            error_u, error_w = rest_u - near * along_u, rest_w - near * along_w
            error = error_u * rest_u + error_w * rest_w
            # Cauchy's weights: what is far off, such as other traffic, hardly counts.
            robust = weight / (1.0 + error / self._deviation ** 2)
            known[_B] = near * ahead, -near * y * along_u
            known[_C, 1] = near
            along = known[:, 0] * along_u + known[:, 1] * along_w
            weighted = known * robust
            normal = weighted.reshape(5, -1) @ known.reshape(5, -1).T
            normal -= (along * (robust * forwards / squared)) @ along.T
            normal[np.diag_indices(5)] += trust
            gradient = weighted[:, 0] @ error_u + weighted[:, 1] @ error_w
            gradient += trust * (state - prior)
            try:
                inverse = np.linalg.inv(normal)
            except np.linalg.LinAlgError:
                return None
            state -= inverse @ gradient
        covariance = inverse * self._deviation ** 2
        agreeing = float(weight[error < (_OUTLIER * self._deviation) ** 2].sum())
        return CameraMotion(
            yaw=float(state[_YAW]), pitch=float(state[_PITCH]), roll=float(state[_ROLL]),
            travel=Travel(float(state[_B]), float(state[_C]),
                          float(covariance[_B, _B]), float(covariance[_C, _C])),
            agreeing=agreeing, agreement=agreeing / float(weight.sum()))
