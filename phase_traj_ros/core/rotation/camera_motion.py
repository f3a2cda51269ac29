# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Rotation of the camera from the displacements of blocks on the cylinder, at any distance.

Consider a point at azimuth t (positive to the right), slope y (positive down) and horizontal
distance d. If the camera rotates by a small angle and translates by s, the point moves on the
cylinder by

    u = yaw + y (pitch sin t + roll cos t)         + q sin(t - b)
    w = (1 + y**2) (pitch cos t - roll sin t)      + q (y cos(t - b) - c),    q = s / d.

u is positive to the right, w down, both in radians (w as a slope). Yaw is positive to the left
(REP 103). Pitch and roll are rotations about the x (right) and z (forward) axes of the image. b is
the azimuth of the direction of travel, c its slope.

The first terms do not depend on the distance. The last terms lie, for each point, along one line.
The component of (u, w) across this line therefore gives the rotation independent of all distances.
This is the differential form of the epipolar constraint (Longuet-Higgins and Prazdny, "The
interpretation of a moving retinal image", 1980).

Three constraints are added. The camera moves past all points in one direction: q >= 0, or q <= 0
in reverse. q is bounded, so both u and w count for a point in the direction of travel, which
hardly moves at any distance. The direction of travel of a vehicle is close to straight ahead.
"""

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.lens_family import Numbers
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.tuning import TUNING

_YAW, _PITCH, _ROLL, _B, _C, _ERROR = range(6)


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """Rotation of the camera between two frames, in radians, and the agreement of the blocks."""

    yaw: float
    """Positive to the left."""
    pitch: float
    """Positive nose up, unlike ``Horizon.pitch``."""
    roll: float
    """Positive right side down."""
    travel: FocusOfExpansion
    agreeing: float
    """Sum of the weights of the blocks that agree with this motion."""
    agreement: float
    """``agreeing`` as a share of all weights, 0 to 1."""
    yaw_variance: float
    """Variance of the yaw in square radians, from the scatter of the blocks."""
    passing: float
    """Median q of the blocks, without its sign: translation of the camera divided by their
    distance."""
    age: float = 0.0
    """Seconds from the keyframe, from which ``travel`` and ``passing`` are measured; ``near`` and
    the rotation are those of the newest pair, and the slope is that in its second frame."""
    near: float = 0.0
    """The q that a tenth of the blocks exceed by their errors, as they are near; negative in
    reverse."""

    def nod(self, roll: float) -> float:
        """Return the pitch less the part of a turn that a camera with a ``roll`` sees as one."""
        return self.pitch + self.yaw * math.tan(roll)

    def holds(self, share: float) -> bool:
        """Return whether at least this share of the blocks agrees, and enough of them."""
        return self.agreement >= share and self.agreeing >= TUNING.min_blocks

    @property
    def certain(self) -> bool:
        """Return whether most of the blocks agree."""
        return self.agreement >= TUNING.doubted_share


class MotionFit:
    """Fits the model of this module to the displacements of fixed blocks, by least squares."""

    def __init__(self, azimuths: Numbers, slopes: Numbers, *, deviation: float) -> None:
        """
        Make a fit for blocks at these azimuths and slopes, (N,) each, in radians.

        ``deviation`` is the standard deviation of the displacement of a block, in radians.
        """
        self._azimuths = azimuths
        self._slopes = slopes
        self._deviation = deviation
        self._least = (deviation / TUNING.inverse_depth_deviation) ** 2

    def __call__(
        self, u: Numbers, w: Numbers, weight: Numbers, travel: FocusOfExpansion, *,
        aside: Numbers | float = 0.0, down: Numbers | float = 0.0,
        precision: Numbers | float = 1.0, reverses: bool = True,
    ) -> CameraMotion | None:
        """
        Return the motion that fits the displacements, (N,) in radians; None if they are too few.

        ``travel`` is the predicted direction of travel. The displacements are those of points that
        are ``aside`` to the right and ``down`` from the centres of the blocks, in radians. Each
        counts with its weight for the agreement, and with that and its ``precision`` for the fit.
        ``reverses`` is whether the camera may move backwards.
        """
        used = np.flatnonzero(weight > 0.0)
        if len(used) <= _C:
            return None
        precise = (precision * weight)[used]
        u, w, weight = u[used], w[used], weight[used]
        # Evaluated half-way along the displacement, so that both directions of time are equal.
        azimuth = (self._azimuths + aside)[used] + u / 2
        y = (self._slopes + down)[used] + w / 2
        points = np.array([u, w, azimuth, y, weight, precise])
        total, median = float(weight.sum()), quantile(u, 0.5)
        best = self._solved(points, travel, median)
        if best is None or best.agreeing / total < TUNING.restart_share:
            ahead = (np.abs(azimuth - travel.course) < TUNING.ahead_size[0]) & (
                np.abs(y - travel.slope) < TUNING.ahead_size[1])
            if ahead.any():
                other = self._solved(points, travel, quantile(u[ahead], 0.5))
                if best is None or (other is not None and other.agreeing > best.agreeing):
                    best = other
            if reverses:
                back = self._solved(points, travel, median, sign=-1.0)
                least = max(TUNING.min_agreement * total, 0.0 if best is None else best.agreeing)
                # What rests agrees with forward, too: beside a leader that pulls away, the whole
                # scene.
                if back is not None and back.receding > least:
                    best = back
        return None if best is None else self._motion(best, total)

    def _solved(
        self, points: Numbers, travel: FocusOfExpansion, yaw: float, *, sign: float = 1.0,
    ) -> '_Equations | None':
        """
        Return the equations at their solution, searched from a yaw on.

        ``sign`` is that of q.

        None if it is not determined, or no block agrees with it.
        """
        variance = self._deviation ** 2
        equations = _Equations(
            points, np.array([yaw, 0.0, 0.0, travel.course, travel.slope]),
            variance * np.diag(
                [0.0, 0.0, 0.0, 1 / travel.course_variance, 1 / travel.slope_variance]),
            variance=variance, least=self._least, sign=sign)
        # Cauchy weights: outliers, such as other traffic, have little effect.
        solved = equations.solve(steps=TUNING.fit_steps, power=1)
        return equations if solved and equations.agreeing > 0.0 else None

    def _motion(self, equations: '_Equations', total: float) -> CameraMotion:
        """Return the motion that solves the equations; ``total`` is the sum of all weights."""
        near, agreeing = np.abs(equations.near), equations.agreeing
        certain_q = np.maximum(near - self._deviation / np.sqrt(equations.squared), 0.0)
        certain_q = certain_q[equations.agrees]
        course_variance = self._deviation ** 2 * float(equations.inverse[_B, _B])
        yaw_variance = self._yaw_variance(equations)
        yaw, pitch, roll, course, _ = equations.state.tolist()
        # Last, as it solves the equations again.
        slope, slope_variance = self._slope(equations)
        return CameraMotion(
            yaw=yaw, pitch=pitch, roll=roll,
            travel=FocusOfExpansion(course, slope, course_variance, slope_variance),
            agreeing=agreeing, agreement=agreeing / total,
            yaw_variance=yaw_variance, passing=quantile(near, 0.5),
            near=equations.sign * quantile(certain_q, 0.9))

    def _yaw_variance(self, equations: '_Equations') -> float:
        """Return the variance of the yaw in square radians."""
        # That of an M-estimate: its scores scatter as the blocks do, and an outlier, which has a
        # small weight, adds little to them (Huber and Ronchetti, "Robust Statistics", 6.3).
        variance, error, robust = self._deviation ** 2, equations.error, equations.robust
        # Their derivative is smaller than the weights, as these fall with the errors.
        slopes = (1.0 - (equations.near != 0.0) * error / variance) / (1.0 + error / variance)
        mean_slope = max(float((robust * slopes).sum() / robust.sum()), TUNING.min_score_slope)
        of_yaw = cv2.invert(mean_slope * equations.normal + equations.trust)[1][_YAW]
        return float(np.square(of_yaw @ equations.scores).sum()
                     + variance * of_yaw @ equations.trust @ of_yaw)

    def _slope(self, equations: '_Equations') -> tuple[float, float]:
        """
        Return the slope of the direction of travel and its variance, from the solution on.

        Blocks that fail on a dark road err mostly sideways, which seems to be a direction of
        travel nearer to the road. So the weights fall faster with the error here (Geman and
        McClure, "Statistical methods for tomographic image reconstruction", 1987). With such
        weights for the rotation, too, the heading would drift more.
        """
        solution, inverse = equations.state, equations.inverse
        equations.solve(steps=TUNING.slope_steps, power=2)
        # Far from the prior, as with a steep camera at first, the steeper weights would leave out
        # the blocks that contradict it.
        if abs(equations.state[_C] - solution[_C]) < TUNING.slope_deviation / 2:
            solution, inverse = equations.state, equations.inverse
        return float(solution[_C]), self._deviation ** 2 * float(inverse[_C, _C])


class _Equations:
    """The normal equations of the fit for the state: yaw, pitch, roll, b and c."""

    def __init__(
        self, points: Numbers, prior: Numbers, trust: Numbers, *, variance: float, least: float,
        sign: float,
    ) -> None:
        self.state, self._prior, self.trust, self.sign = prior, prior, trust, sign
        self._shift = points[:2]
        self._azimuth, self._y, self._weight, self._precise = points[2:]
        self._variance, self._least = variance, least
        # 1 for a course that is known as on a straight, towards 0 in a turn.
        self._certainty = min(TUNING.course_deviation ** 2 * trust[_B, _B] / variance, 1.0)
        # Effect of each unknown on each point, (6, 3, N): to the right, down, and along the line
        # on which the distance of the point moves it. The last row is the residual.
        y = self._y
        self._terms = terms = np.zeros((_ERROR + 1, 3, len(y)))
        terms[_YAW, 0] = -1.0
        sine, cosine, bulge = np.sin(self._azimuth), np.cos(self._azimuth), 1.0 + y * y
        terms[_PITCH, 0], terms[_PITCH, 1] = -y * sine, -bulge * cosine
        terms[_ROLL, 0], terms[_ROLL, 1] = -y * cosine, bulge * sine
        self._rotations = terms[:_B, :2].reshape(_B, -1)
        self._along, self._factor = np.empty_like(self._shift), np.empty((3, len(y)))

    def solve(self, *, steps: int, power: int) -> bool:
        """
        Improve the state by steps of the Gauss-Newton method; return False if it is undetermined.

        The weights are 1 / (1 + error / variance), to this power, and less for what recedes.
        """
        for _ in range(steps):
            self._linearise(self.state, power)
            # OpenCV instead of LAPACK, whose threads cost more than this small inversion.
            solvable, inverse = cv2.invert(self.normal + self.trust)
            if not solvable:
                return False
            self.inverse = np.asarray(inverse)
            self.state = self.state - self.inverse @ (
                self._gradient + self.trust @ (self.state - self._prior))
        return True

    @property
    def agrees(self) -> NDArray[np.bool_]:
        """Return which points agree with the state, (N,)."""
        return self.error < TUNING.outlier_deviations ** 2 * self._variance

    @property
    def agreeing(self) -> float:
        """Return the sum of the weights of the points that agree."""
        return float(self._weight[self.agrees].sum())

    @property
    def receding(self) -> float:
        """Return the sum of the weights of the points that agree, and certainly move along."""
        moves = np.square(self.near) * self.squared > self._variance
        return float(self._weight[self.agrees & moves].sum())

    def _linearise(self, state: Numbers, power: int) -> None:
        terms, along, factor, y = self._terms, self._along, self._factor, self._y
        apart = self._azimuth - state[_B]
        ahead = np.cos(apart)
        np.sin(apart, out=along[0])
        np.subtract(y * ahead, state[_C], out=along[1])
        unrotated = self._shift + (state[:_B] @ self._rotations).reshape(along.shape)
        self.squared = _dot(along, along) + self._least
        near = _dot(unrotated, along) / self.squared
        passes = self.sign * near > 0.0
        # What recedes on a straight is other traffic, such as vehicles that overtake on one side,
        # where they would seem to be a turn. Beside a course that is not known, points that the
        # camera passes seem to recede, too, and by less than a deviation, all points may.
        against = np.where(passes, 0.0, near * near * self.squared / self._variance)
        against *= self._certainty * against / (1.0 + against)
        near *= passes
        terms[_ERROR, :2] = unrotated - near * along
        self.error = _dot(terms[_ERROR, :2], unrotated)
        """Squared error of each point, in square radians, ..."""
        self.near = near
        """...its q, of this sign or 0, ..."""
        factor[:2] = self.robust = self._precise * (
            1.0 + self.error / self._variance) ** -power / (1.0 + against)
        """...and its weight, (N,)."""
        # The component along the line determines the distance of the point only.
        np.divide(self.robust * passes, -self.squared, out=factor[2])
        terms[_B, 0], terms[_B, 1] = near * ahead, -near * y * along[0]
        terms[_C, 1] = near
        terms[:_ERROR, 2] = terms[:_ERROR, 0] * along[0] + terms[:_ERROR, 1] * along[1]
        normal = (terms[:_ERROR] * factor).reshape(_ERROR, -1) @ terms.reshape(_ERROR + 1, -1).T
        self.normal, self._gradient = normal[:, :_ERROR], normal[:, _ERROR]

    @property
    def scores(self) -> Numbers:
        """Return the part of each point in the gradient, (5, N)."""
        weighted = self._factor * self._terms[_ERROR]
        return np.asarray((self._terms[:_ERROR] * weighted).sum(axis=1))


def _dot(first: Numbers, second: Numbers) -> Numbers:
    """Return the scalar products of vectors, (2, N) each, as ``sum`` does in twice the time."""
    across, down = first * second
    return across + down  # type: ignore[no-any-return]


def running_mean(mean: float, value: float, interval: float, *, time: float) -> float:
    """Return a mean with a ``time`` constant after ``interval``, both in seconds, with a value."""
    return mean + (1.0 - math.exp(-interval / time)) * (value - mean)


def quantile(values: Numbers, share: float) -> float:
    """Return the quantile of values, (N,) with N > 0, as numpy does in ten times the time."""
    ordered, place = np.sort(values), share * (len(values) - 1)
    below = int(place)
    low, high = ordered[below], ordered[min(below + 1, len(values) - 1)]
    return float(low + (place - below) * (high - low))
