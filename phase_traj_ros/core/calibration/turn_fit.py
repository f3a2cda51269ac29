# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the lens from points tracked through a turn, by a bundle adjustment.

In one pair of frames, a wrong focal length changes the flow as other distances do. Over a turn,
only the correct lens keeps each point at one position in the scene. The unknowns are the lens, the
position and attitude of the camera at several frames of the turn, and the inverse depth of each
point. The points are eliminated (Triggs, McLauchlan, Hartley and Fitzgibbon, "Bundle adjustment -
a modern synthesis", 2000). The direction of a point comes from the middle one of its frames.

A prior for the motion of vehicles constrains the solution: a vehicle moves in its viewing
direction, by similar distances between frames, and turns about one axis. A constant deviation
costs less than one that changes: a camera ahead of the rear axle moves sideways in a turn, and a
pitched one moves upwards in its image and rolls.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.algebra import (
    batch_matvec,
    cross_matrices,
    matvec,
    rotation_matrices,
    solve,
    transposed_product,
)
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_tracks import TurnTracks
from phase_traj_ros.core.camera.lens_family import (
    Numbers,
    project,
    projection_jacobians,
    STRAIGHTNESS_RANGE,
    unproject,
)


@dataclass(frozen=True, slots=True, eq=False)
class TurnFit:
    """
    The lens estimated from a part of a turn.

    log_focal, straightness
        Logarithm of the focal length in pixels, and straightness (k of ``lens_family``).
    column
        Column of the principal point, in pixels to the right of the image centre.
    covariance
        Covariance (3, 3) of these three, from the errors of the points alone.
    cost
        Mean cost of an observation: 1 or 2 for a static scene and a lens of the family.
    down
        Downward direction, (3,), in image axes (x right, y down, z forward): the axis of the turn,
        perpendicular to the direction of travel.
    angle
        Rotation of the camera in radians, positive to the left.
    point_costs
        Mean cost of the observations of each point, (P,).
    ambiguous
        Whether another focal length fits nearly as well: in a gentle bend, parallax explains
        nearly all with any lens, which the covariance at a short focal length does not show.
    """

    log_focal: float
    straightness: float
    column: float
    covariance: Numbers
    cost: float
    down: Numbers
    angle: float
    point_costs: Numbers
    ambiguous: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """
    Unknowns: lens, K attitudes (world to camera) and positions, P inverse depths.

    The lens is the logarithm of the focal length, the straightness, and the column, (3,).
    """

    lens: Numbers
    attitude: Numbers
    position: Numbers
    inverse_depth: Numbers


def fit_turn(
    tracks: TurnTracks, guesses: Sequence[tuple[float, float, float]], *, width: int,
) -> TurnFit | None:
    """
    Return the lens that fits the tracks best, or None if the fit fails.

    ``guesses`` are start values: focal length in pixels, straightness, and column of the principal
    point in pixels from the centre of an image ``width`` pixels wide. If there are several, each
    is optimised for a few iterations, and then the best of them to convergence. The one whose
    focal length differs most from it is optimised as well, to tell whether the fit is ambiguous,
    unless it costs far more already.
    """
    problem = _Problem(tracks, width)
    found = [problem.start(*guess) for guess in guesses]
    if len(found) == 1:
        return problem.result(problem.search(found[0], TUNING.fit_steps))
    found = [problem.search(state, TUNING.first_steps) for state in found]
    best = problem.search(min(found, key=problem.cost), TUNING.fit_steps)
    other = max(found, key=lambda each: abs(float(each.lens[0] - best.lens[0])))
    cost = problem.cost(best)
    if problem.cost(other) > TUNING.hopeless_cost * cost:
        return problem.result(best)
    other = problem.search(other, TUNING.fit_steps)
    lower, higher = sorted((cost, problem.cost(other)))
    return problem.result(best, ambiguous=bool(
        abs(other.lens[0] - best.lens[0]) > TUNING.other_focal
        and higher < TUNING.other_cost * lower))


class _Problem:
    """The observations of one turn, and the cost of a state."""

    def __init__(self, tracks: TurnTracks, width: int) -> None:
        points = np.arange(tracks.point[-1] + 1)
        first, end = (
            np.searchsorted(tracks.point, points, side=side) for side in ('left', 'right'))
        middle = ((first + end - 1) // 2)[tracks.point]
        used = np.flatnonzero(np.arange(len(tracks.point)) != middle)
        self._point, self._frame = tracks.point[used], tracks.frame[used]
        self._observed = tracks.position[used]
        self._base, self._base_position = tracks.frame[middle[used]], tracks.position[middle[used]]
        self._starts = np.searchsorted(self._point, points)
        self._flow, self._deviation = tracks.flow, TUNING.point_deviation_px * tracks.reduction
        # A slow step lasts until its parallax is sufficient, so its distance is not as unusual as
        # its duration: a vehicle may slow to a creep within a turn, or stop.
        steps, most = np.diff(tracks.seconds), TUNING.max_duration_ratio
        steps = np.clip(steps / np.median(steps), 1.0 / most, most)
        self._steps = steps / steps.mean()
        self._frame_count = len(tracks.flow)
        # Where the derivatives of an observation are in the normal equations: rotation and
        # translation of its frame and of its base frame, the lens, and the error, (M, 16). The
        # first frame is fixed: its columns come last, before that of the error.
        frames = (np.stack([self._frame, self._base], axis=1) - 1) % self._frame_count
        unknowns = (3 + 6 * frames[:, :, None] + np.arange(6)).reshape(-1, 12)
        self._size = 6 * self._frame_count + 4
        places = np.column_stack([unknowns, np.tile([0, 1, 2, self._size - 1], (len(used), 1))])
        self._places = self._size * places[:, :, None] + places[:, None]
        self._point_places = self._size * self._point[:, None] + places
        # Share of the mean to subtract, which whitens deviations with a common part.
        common = (self._frame_count - 1) * TUNING.common_factor ** 2
        self._mean_factor = 1.0 - 1.0 / math.sqrt(1.0 + common)
        self._column = TUNING.column_deviation * width

    def search(self, state: _State, iterations: int) -> _State:
        """Optimise a state by the Levenberg-Marquardt method."""
        cost, damping = self.cost(state), TUNING.first_damping
        for _ in range(iterations):
            normal, mixed, point_normal, gradient, point_gradient = self._normal(state)
            for _ in range(TUNING.damping_tries):
                damped = point_normal * (1.0 + damping)
                system = normal + damping * np.diag(np.diag(normal))
                system -= transposed_product(mixed / damped[:, None], mixed)
                try:
                    right = matvec(mixed.T, point_gradient / damped) - gradient
                    step = solve(system, right[:, None])[:, 0]
                except np.linalg.LinAlgError:
                    return state
                depth_step = -(point_gradient + matvec(mixed, step)) / damped
                trial = _updated(state, step, depth_step)
                found = self.cost(trial)
                if found < cost:
                    break
                damping *= 8.0
            else:
                return state
            focal, straightness, _ = np.abs(trial.lens - state.lens)
            settled = (
                found > cost * (1.0 - TUNING.min_gain) and focal < TUNING.converged_focal
                and straightness < TUNING.converged_straightness)
            state, cost, damping = trial, found, max(damping / 6.0, TUNING.min_damping)
            if settled:
                break
        return state

    def result(self, state: _State, *, ambiguous: bool = False) -> TurnFit | None:
        """Return the fit of a state with its covariance; None if it is undetermined."""
        normal, mixed, point_normal, _, _ = self._normal(state)
        try:
            covariance = solve(
                normal - transposed_product(mixed / point_normal[:, None], mixed),
                np.eye(len(normal), 3))[:3]
        except np.linalg.LinAlgError:
            return None
        axis = cv2.Rodrigues(state.attitude[-1] @ state.attitude[0].T)[0][:, 0]
        angle = math.copysign(float(np.linalg.norm(axis)), float(axis[1]))
        if angle == 0.0 or not (np.isfinite(covariance).all() and covariance[0, 0] > 0.0):
            return None
        down = _down(state, axis / angle)
        if not np.isfinite(down).all():
            return None
        log_focal, straightness, column = state.lens.tolist()
        return TurnFit(
            log_focal, straightness, column, covariance,
            self.cost(state) / len(self._observed), down, angle,
            np.add.reduceat(self._costs(state), self._starts) / np.bincount(self._point),
            ambiguous)

    def start(self, focal_px: float, straightness: float, column: float) -> _State:
        """Return a start state: a rotation about the vertical image axis at a constant speed."""
        turned = np.zeros((self._frame_count, 3))
        turned[:, 1] = self._flow / focal_px
        attitude = rotation_matrices(turned)
        ahead = attitude[:, 2]
        position = np.zeros((self._frame_count, 3))
        position[1:] = np.cumsum((ahead[1:] + ahead[:-1]) / 2.0 * self._steps[:, None], axis=0)
        return _State(
            np.array([math.log(focal_px), straightness, column]), attitude, position,
            np.full(len(self._starts), TUNING.start_inverse_depth))

    def _motions(self, state: _State) -> tuple[Numbers, Numbers]:
        """Return the rotations and translations from the base frame to that of an observation."""
        # By frame and base frame, as there are more observations than pairs of frames.
        attitude, position = state.attitude[:, None], state.position
        between = attitude @ state.attitude.transpose(0, 2, 1)
        translation = attitude @ (position - position[:, None])[..., None]
        pairs = self._frame, self._base
        return between[pairs], translation[pairs][:, :, 0]

    def _projected(
        self, state: _State, between: Numbers, translation: Numbers,
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return rays in the base frames, points in the other frames, and their pixels."""
        log_focal, straightness, column = state.lens.tolist()
        ray = unproject(self._base_position - (column, 0.0), math.exp(log_focal), straightness)
        seen = batch_matvec(between, ray) + state.inverse_depth[self._point][:, None] * translation
        found = project(seen, math.exp(log_focal), straightness)
        found[:, 0] += column
        return ray, seen, found

    def _costs(self, state: _State) -> Numbers:
        """Return the cost of each observation, which grows slowly with large errors."""
        found = self._projected(state, *self._motions(state))[2]
        error = (found - self._observed) / self._deviation
        return np.asarray(2.0 * np.log1p((error * error).sum(axis=1) / 2.0), np.float64)

    def cost(self, state: _State) -> float:
        """Return the cost of a state: errors of the observations, and deviations from priors."""
        robust = float(self._costs(state).sum())
        residuals = self._prior_residuals(state)[0]
        behind = np.minimum(state.inverse_depth, 0.0)
        depths = state.inverse_depth / TUNING.inverse_depth_deviation
        _, straightness, column = state.lens
        # The cost of the column is robust, as for the observations: images may be cropped.
        straightness = (straightness - TUNING.prior_straightness) / TUNING.straightness_deviation
        lens = straightness ** 2 + 2.0 * math.log1p((column / self._column) ** 2 / 2.0)
        cost = lens + robust + float(
            (residuals * residuals).sum() + TUNING.positive_depth_weight * (behind @ behind)
            + depths @ depths)
        return cost if math.isfinite(cost) else math.inf

    def _prior_residuals(self, state: _State) -> tuple[Numbers, Numbers]:
        """Return the deviations of the motion from the prior, (K - 1, 5), and its axes."""
        axes = state.attitude[1:] + state.attitude[:-1]
        axes /= np.linalg.norm(axes, axis=2, keepdims=True)
        right, ahead = axes[:, 0], axes[:, 2]
        axes = np.stack([
            ahead / TUNING.speed_deviation, right / TUNING.sideways_deviation,
            batch_matvec(cross_matrices(ahead), right) / TUNING.sideways_deviation], axis=1)
        axes /= self._steps[:, None, None]
        turned = state.attitude[1:] @ state.attitude[:-1].transpose(0, 2, 1)
        residuals = np.zeros((self._frame_count - 1, 5))
        residuals[:, :3] = batch_matvec(axes, state.position[1:] - state.position[:-1])
        residuals[:, 0] -= 1.0 / TUNING.speed_deviation
        # About the viewing direction and the horizontal axis.
        skew = turned - turned.transpose(0, 2, 1)
        residuals[:, 3:] = skew[:, (2, 1), (1, 0)] / (2.0 * TUNING.shake_deviation)
        residuals[:, 1:] -= self._mean_factor * residuals[:, 1:].mean(axis=0)
        return residuals, axes

    def _normal(self, state: _State) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers]:
        """Return the normal equations: of the camera, mixed, of the points; both gradients."""
        between, translation = self._motions(state)
        ray, seen, found = self._projected(state, between, translation)
        error = (found - self._observed) / self._deviation
        # The square root of the weight of an observation, per pixel.
        root = 1.0 / np.sqrt(1.0 + (error * error).sum(axis=1, keepdims=True) / 2.0)
        error *= root
        root /= self._deviation
        change = projection_jacobians(seen, math.exp(state.lens[0]), float(state.lens[1]))
        change *= root[:, :, None]
        inverse_depth = state.inverse_depth[self._point]
        # Two rows per observation, with the columns of ``_places``.
        rows = np.empty((len(self._observed), 2, 16))
        moved = (change @ state.attitude[self._frame]) * inverse_depth[:, None, None]
        rows[:, :, :3], rows[:, :, 3:6] = change @ cross_matrices(-seen), -moved
        rows[:, :, 6:9], rows[:, :, 9:12] = change @ between @ cross_matrices(ray), moved
        for number, step in enumerate(TUNING.derivative_step * np.eye(3)):
            stepped = replace(state, lens=state.lens + step)
            there = self._projected(stepped, between, translation)[2]
            rows[:, :, 12 + number] = (there - found) * (root / TUNING.derivative_step)
        rows[:, :, 15] = error
        by_depth = batch_matvec(change, translation)
        sums = self._summed(rows.transpose(0, 2, 1) @ rows, self._places)
        prior_normal, prior_gradient = self._prior_normal(state)
        normal, gradient = sums[:-7, :-7] + prior_normal, sums[:-7, -1] + prior_gradient
        sums = self._summed(by_depth[:, None] @ rows, self._point_places)
        mixed, point_gradient = sums[:, :-7], sums[:, -1]
        point_normal = np.add.reduceat((by_depth * by_depth).sum(axis=1), self._starts)
        prior = TUNING.positive_depth_weight * (state.inverse_depth < 0.0)
        prior = prior + TUNING.inverse_depth_deviation ** -2
        point_gradient = point_gradient + prior * state.inverse_depth
        return normal, mixed, point_normal + prior, gradient, point_gradient

    def _summed(self, values: Numbers, places: NDArray[np.int64]) -> Numbers:
        """Return the sums of the values at each place of a flat matrix."""
        sums = np.bincount(places.ravel(), values.ravel())
        return np.asarray(sums.reshape(-1, self._size), np.float64)

    def _prior_normal(self, state: _State) -> tuple[Numbers, Numbers]:
        """Return the normal equations and the gradient of the priors."""
        residuals, axes = self._prior_residuals(state)
        steps = np.arange(self._frame_count - 1)
        rows = np.zeros((self._frame_count - 1, 5, self._frame_count, 6))
        for frame, sign in ((steps + 1, 1.0), (steps, -1.0)):
            rows[steps, :3, frame, 3:] = sign * axes
            rows[steps, 3, frame, 0] = rows[steps, 4, frame, 2] = sign / TUNING.shake_deviation
        rows[:, 1:] -= self._mean_factor * rows[:, 1:].mean(axis=0)
        jacobian = rows[:, :, 1:].reshape(-1, 6 * (self._frame_count - 1))
        normal = np.zeros((3 + jacobian.shape[1],) * 2)
        normal[3:, 3:] = transposed_product(jacobian, jacobian)
        _, straightness, column = state.lens
        normal[1, 1] = TUNING.straightness_deviation ** -2
        normal[2, 2] = self._column ** -2 / (1.0 + (column / self._column) ** 2 / 2.0)
        off = straightness - TUNING.prior_straightness
        lens = (0.0, off / TUNING.straightness_deviation ** 2, normal[2, 2] * column)
        return normal, np.concatenate([lens, matvec(jacobian.T, residuals.ravel())])


def _down(state: _State, axis: Numbers) -> Numbers:
    """Return the axis of a turn, (3,) downward, perpendicular to the direction of travel."""
    # The lean of a vehicle that changes within the turn tilts the axis forwards or backwards.
    moved = batch_matvec(state.attitude[1:] + state.attitude[:-1], np.diff(state.position, axis=0))
    travel = moved.sum(axis=0)
    travel /= np.linalg.norm(travel)
    down = axis - (axis @ travel) * travel
    return np.asarray(down / np.linalg.norm(down), np.float64)


def _updated(state: _State, step: Numbers, depth_step: Numbers) -> _State:
    """Return the state after a step."""
    limit = np.array([TUNING.max_focal_step, TUNING.max_straightness_step, math.inf])
    lens = state.lens + np.clip(step[:3], -limit, limit)
    lens[1] = np.clip(lens[1], *STRAIGHTNESS_RANGE)
    frames = step[3:].reshape(-1, 6)
    attitude, position = state.attitude.copy(), state.position.copy()
    attitude[1:] = rotation_matrices(frames[:, :3]) @ attitude[1:]
    position[1:] += frames[:, 3:]
    inverse_depth = np.maximum(state.inverse_depth + depth_step, TUNING.min_inverse_depth)
    return _State(lens, attitude, position, inverse_depth)
