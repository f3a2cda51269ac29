# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the lens from points tracked through a turn, by a bundle adjustment.

One pair of frames is not sufficient: for a camera that moves in its viewing direction, a wrong
focal length changes the flow in the same way as other distances. But each point has one distance.
While the turn moves it across the image, only the correct lens keeps it at one position in the
scene. The unknowns are the lens, the position and attitude of the camera at several frames of the
turn, and the inverse distance of each point. The points are eliminated (Triggs, McLauchlan,
Hartley and Fitzgibbon, "Bundle adjustment - a modern synthesis", 2000). The direction of a point
comes from the middle one of the frames that show it.

A prior for the motion of vehicles constrains the solution: a vehicle moves in its viewing
direction, by similar distances between frames, and turns about one axis. A deviation that lasts
throughout the turn is cheaper than one that changes: a camera ahead of the rear axle moves
sideways in a turn, and a pitched one moves upwards in its image and rolls.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import cv2
import numpy as np
from phase_traj_ros.core.calibration.algebra import (
    applied,
    crossed,
    Numbers,
    product,
    rotations,
    times,
)
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_tracks import TurnTracks
from phase_traj_ros.core.camera.lens_family import places, rays, slopes, STRAIGHTNESS_RANGE


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
        Axis of the turn, downward, (3,), in image axes (x right, y down, z forward).
    angle
        Rotation of the camera in radians, positive to the left.
    point_costs
        Mean cost of the observations of each point, (P,).
    """

    log_focal: float
    straightness: float
    column: float
    covariance: Numbers
    cost: float
    down: Numbers
    angle: float
    point_costs: Numbers


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """
    Unknowns: lens, K attitudes (world to camera) and positions, P inverse distances.

    The lens is the logarithm of the focal length, the straightness, and the column, (3,).
    """

    lens: Numbers
    attitude: Numbers
    place: Numbers
    nearness: Numbers


def fit_turn(
    tracks: TurnTracks, guesses: Sequence[tuple[float, float, float]], *, width: int,
) -> TurnFit | None:
    """
    Return the lens that fits the tracks best, or None if the fit fails.

    ``guesses`` are start values: focal length in pixels, straightness, and column of the principal
    point in pixels from the centre of an image ``width`` pixels wide. If there are several, each
    is optimised for a few iterations, and then the best of them to convergence.
    """
    problem = _Problem(tracks, width)
    found = [problem.start(*guess) for guess in guesses]
    if len(found) > 1:
        found = [problem.search(state, TUNING.first_steps) for state in found]
    best = problem.search(min(found, key=problem.cost), TUNING.fit_steps)
    return problem.result(best)


class _Problem:
    """The observations of one turn, and the cost of a state."""

    def __init__(self, tracks: TurnTracks, width: int) -> None:
        points = np.arange(tracks.point[-1] + 1)
        first, end = (
            np.searchsorted(tracks.point, points, side=side) for side in ('left', 'right'))
        middle = ((first + end - 1) // 2)[tracks.point]
        used = np.flatnonzero(np.arange(len(tracks.point)) != middle)
        self._point, self._frame = tracks.point[used], tracks.frame[used]
        self._seen = tracks.place[used]
        self._base, self._based = tracks.frame[middle[used]], tracks.place[middle[used]]
        self._starts = np.searchsorted(self._point, points)
        self._flow, self._deviation = tracks.flow, TUNING.point_deviation_px * tracks.reduction
        steps = np.diff(tracks.seconds)
        self._steps = np.maximum(steps / steps.mean(), TUNING.least_interval)
        self._frames = len(tracks.flow)
        self._sights = np.arange(len(used))
        # Whitens deviations with a common part: what is removed of their mean.
        self._common = 1.0 - 1.0 / math.sqrt(1.0 + (self._frames - 1) * TUNING.lasting ** 2)
        self._column = TUNING.column_deviation * width

    def search(self, state: _State, iterations: int) -> _State:
        """Optimise a state by the Levenberg-Marquardt method."""
        cost, damping = self.cost(state), TUNING.first_damping
        for _ in range(iterations):
            normal, mixed, own, gradient, own_gradient = self._normal(state)
            for _ in range(TUNING.damping_tries):
                less = own * (1.0 + damping)
                system = normal + damping * np.diag(np.diag(normal))
                system -= product(mixed / less[:, None], mixed)
                try:
                    step: Numbers = np.asarray(-np.linalg.solve(
                        system, gradient - times(mixed.T, own_gradient / less)), np.float64)
                except np.linalg.LinAlgError:
                    return state
                near = -(own_gradient + times(mixed, step)) / less
                trial = _moved(state, step, near)
                found = self.cost(trial)
                if found < cost:
                    break
                damping *= 8.0
            else:
                return state
            focal, straightness, _ = np.abs(trial.lens - state.lens)
            settled = (
                found > cost * (1.0 - TUNING.least_gain) and focal < TUNING.settled_focal
                and straightness < TUNING.settled_straightness)
            state, cost, damping = trial, found, max(damping / 6.0, TUNING.least_damping)
            if settled:
                break
        return state

    def result(self, state: _State) -> TurnFit | None:
        """Return the fit of a state with its covariance; None if it is undetermined."""
        normal, mixed, own, _, _ = self._normal(state)
        try:
            inverse = np.linalg.inv(normal - product(mixed / own[:, None], mixed))
        except np.linalg.LinAlgError:
            return None
        covariance = np.asarray(inverse[:3, :3], np.float64)
        axis = cv2.Rodrigues(state.attitude[-1] @ state.attitude[0].T)[0][:, 0]
        angle = math.copysign(float(np.linalg.norm(axis)), float(axis[1]))
        if angle == 0.0 or not (np.isfinite(covariance).all() and covariance[0, 0] > 0.0):
            return None
        log_focal, straightness, column = state.lens.tolist()
        return TurnFit(
            log_focal, straightness, column, covariance, self.cost(state) / len(self._sights),
            axis / angle, angle,
            np.add.reduceat(self._costs(state), self._starts) / np.bincount(self._point))

    def start(self, focal_px: float, straightness: float, column: float) -> _State:
        """Return a start state: a rotation about the vertical image axis at a constant speed."""
        turned = np.zeros((self._frames, 3))
        turned[:, 1] = self._flow / focal_px
        attitude = rotations(turned)
        ahead = attitude[:, 2]
        place = np.zeros((self._frames, 3))
        place[1:] = np.cumsum((ahead[1:] + ahead[:-1]) / 2.0 * self._steps[:, None], axis=0)
        return _State(
            np.array([math.log(focal_px), straightness, column]), attitude, place,
            np.full(len(self._starts), TUNING.start_nearness))

    def _motions(self, state: _State) -> tuple[Numbers, Numbers]:
        """Return the rotations and translations from the base frame to that of an observation."""
        # By frame and base frame, as there are more observations than pairs of frames.
        attitude, place = state.attitude[:, None], state.place
        between = attitude @ state.attitude.transpose(0, 2, 1)
        way = attitude @ (place - place[:, None])[..., None]
        pairs = self._frame, self._base
        return between[pairs], way[pairs][:, :, 0]

    def _sighted(
        self, state: _State, between: Numbers, way: Numbers,
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return rays in the base frame, points seen from the other one, and their places."""
        log_focal, straightness, column = state.lens.tolist()
        ray = rays(self._based - (column, 0.0), math.exp(log_focal), straightness)
        seen = applied(between, ray) + state.nearness[self._point][:, None] * way
        found = places(seen, math.exp(log_focal), straightness)
        found[:, 0] += column
        return ray, seen, found

    def _costs(self, state: _State) -> Numbers:
        """Return the cost of each observation, which grows slowly with large errors."""
        found = self._sighted(state, *self._motions(state))[2]
        error = (found - self._seen) / self._deviation
        return np.asarray(2.0 * np.log1p((error * error).sum(axis=1) / 2.0), np.float64)

    def cost(self, state: _State) -> float:
        """Return the cost of a state: errors of the observations, and deviations from priors."""
        robust = float(self._costs(state).sum())
        known = self._known(state)[0]
        behind = np.minimum(state.nearness, 0.0)
        near = state.nearness / TUNING.nearness
        _, straightness, column = state.lens
        # Robust, as for the observations: a column far off comes from a cropped image, and a
        # larger offset costs little more.
        lens = ((straightness - TUNING.straightness) / TUNING.straightness_deviation) ** 2 + (
            2.0 * math.log1p((column / self._column) ** 2 / 2.0))
        cost = lens + robust + float(
            (known * known).sum() + TUNING.ahead_weight * (behind @ behind) + near @ near)
        return cost if math.isfinite(cost) else math.inf

    def _known(self, state: _State) -> tuple[Numbers, Numbers]:
        """Return the deviations of the motion from the prior, (K - 1, 5), and its axes."""
        axes = state.attitude[1:] + state.attitude[:-1]
        axes /= np.linalg.norm(axes, axis=2, keepdims=True)
        right, ahead = axes[:, 0], axes[:, 2]
        axes = np.stack([
            ahead / TUNING.speed_deviation, right / TUNING.sideways_deviation,
            applied(crossed(ahead), right) / TUNING.sideways_deviation], axis=1)
        axes /= self._steps[:, None, None]
        turned = state.attitude[1:] @ state.attitude[:-1].transpose(0, 2, 1)
        off = np.zeros((self._frames - 1, 5))
        off[:, :3] = applied(axes, state.place[1:] - state.place[:-1])
        off[:, 0] -= 1.0 / TUNING.speed_deviation
        # About the viewing direction and the horizontal axis.
        skew = turned - turned.transpose(0, 2, 1)
        off[:, 3:] = skew[:, (2, 1), (1, 0)] / (2.0 * TUNING.shake_deviation)
        off[:, 1:] -= self._common * off[:, 1:].mean(axis=0)
        return off, axes

    def _normal(self, state: _State) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers]:
        """Return the normal equations: of the camera, mixed, of the points; both gradients."""
        between, way = self._motions(state)
        ray, seen, found = self._sighted(state, between, way)
        error = (found - self._seen) / self._deviation
        # The square root of the weight of an observation, per pixel.
        root = 1.0 / np.sqrt(1.0 + (error * error).sum(axis=1, keepdims=True) / 2.0)
        error *= root
        root /= self._deviation
        change = slopes(seen, math.exp(state.lens[0]), float(state.lens[1])) * root[:, :, None]
        nearness = state.nearness[self._point]
        # Two rows per observation; per frame, three rotations and three translations; the error.
        rows = np.zeros((len(self._sights), 2, self._frames + 1, 6))
        moved = (change @ state.attitude[self._frame]) * nearness[:, None, None]
        rows[self._sights, :, self._frame, :3] = change @ crossed(-seen)
        rows[self._sights, :, self._base, :3] = change @ between @ crossed(ray)
        rows[self._sights, :, self._frame, 3:] = -moved
        rows[self._sights, :, self._base, 3:] = moved
        # The first frame is fixed: the lens takes the place of its translation.
        for number, step in enumerate(TUNING.delta * np.eye(3)):
            there = self._sighted(replace(state, lens=state.lens + step), between, way)[2]
            rows[:, :, 0, 3 + number] = (there - found) * (root / TUNING.delta)
        rows[:, :, -1, 0] = error
        jacobian = rows.reshape(2 * len(rows), -1)[:, 3:-5]
        own = applied(change, way)
        sums = product(jacobian[:, :-1], jacobian)
        known, known_gradient = self._known_normal(state)
        normal, gradient = sums[:, :-1] + known, sums[:, -1] + known_gradient
        mixed = np.add.reduceat(jacobian[:, :-1] * own.reshape(-1, 1), 2 * self._starts)
        points = np.add.reduceat((own * own).sum(axis=1), self._starts)
        toward = np.add.reduceat((own * error).sum(axis=1), self._starts)
        behind = TUNING.ahead_weight * (state.nearness < 0.0) + TUNING.nearness ** -2
        return normal, mixed, points + behind, gradient, toward + behind * state.nearness

    def _known_normal(self, state: _State) -> tuple[Numbers, Numbers]:
        """Return the normal equations and the gradient of the priors."""
        off, axes = self._known(state)
        steps = np.arange(self._frames - 1)
        rows = np.zeros((self._frames - 1, 5, self._frames, 6))
        for frame, sign in ((steps + 1, 1.0), (steps, -1.0)):
            rows[steps, :3, frame, 3:] = sign * axes
            rows[steps, 3, frame, 0] = rows[steps, 4, frame, 2] = sign / TUNING.shake_deviation
        rows[:, 1:] -= self._common * rows[:, 1:].mean(axis=0)
        jacobian = rows[:, :, 1:].reshape(-1, 6 * (self._frames - 1))
        normal = np.zeros((3 + jacobian.shape[1],) * 2)
        normal[3:, 3:] = product(jacobian, jacobian)
        _, straightness, column = state.lens
        normal[1, 1] = TUNING.straightness_deviation ** -2
        normal[2, 2] = self._column ** -2 / (1.0 + (column / self._column) ** 2 / 2.0)
        lens = (0.0, (straightness - TUNING.straightness) / TUNING.straightness_deviation ** 2,
                normal[2, 2] * column)
        return normal, np.concatenate([lens, times(jacobian.T, off.ravel())])


def _moved(state: _State, step: Numbers, near: Numbers) -> _State:
    """Return the state after a step."""
    farthest = np.array([TUNING.farthest_focal, TUNING.farthest_straightness, math.inf])
    lens = state.lens + np.clip(step[:3], -farthest, farthest)
    lens[1] = np.clip(lens[1], *STRAIGHTNESS_RANGE)
    frames = step[3:].reshape(-1, 6)
    attitude, place = state.attitude.copy(), state.place.copy()
    attitude[1:] = rotations(frames[:, :3]) @ attitude[1:]
    place[1:] += frames[:, 3:]
    return _State(lens, attitude, place, np.maximum(state.nearness + near, TUNING.behind))
