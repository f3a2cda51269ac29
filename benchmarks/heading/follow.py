# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs the estimator of the node over the rides of the heading study, and scores it."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.heading.drives import Ride
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, TrajectoryEstimator
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.tasks.evaluation.ground_truth import MatchedTruth
from phase_traj_ros.tasks.evaluation.scores import (
    heading_error,
    HeadingError,
    turn_score,
    TurnScore,
)


@dataclass(frozen=True)
class Result:
    """Result of one ride."""

    ride: Ride
    headings: np.ndarray
    """Radians, at each frame."""
    turns: list[Turn]
    codes: tuple[int, ...]
    bridged: int

    @property
    def truth(self) -> MatchedTruth:
        """Return the ground truth in the form of an evaluation."""
        return truth_of(self.ride)

    @property
    def error(self) -> HeadingError:
        """Return the errors of the heading."""
        return heading_error(self.headings, self.truth)

    @property
    def score(self) -> TurnScore:
        """Return the score of the turns."""
        return turn_score(self.turns, self.truth)

    @property
    def found(self) -> str:
        """Return the turns found and the true ones, and what is wrong."""
        score = self.score
        wrong = '' if score.precision == score.recall == 1.0 else ' **wrong**'
        return f'{score.found} / {score.true}{wrong}'


class Follower:
    """Follows one camera like the node, given the focal length only."""

    def __init__(
        self, ride: Ride, focal_px: float | None = None, *, source: CodeSource = CodeSource.AUTO,
    ) -> None:
        self._ride = ride
        self._estimator = TrajectoryEstimator(EstimatorSettings(
            code_source=source, lens=Lens(focal_px=focal_px or ride.camera.focal)))
        self._codes = HeadingCode()
        self._headings = [0.0]
        self._frames = 0

    def update(self, frame: np.ndarray) -> float | None:
        """Take the next frame; return the change of the heading."""
        update = self._estimator.update(frame, self._ride.stamps_ns[self._frames])
        self._frames += 1
        if update is None:
            return None
        step = update.heading
        assert step is not None
        self._codes.update(step.heading, step.rate)
        self._headings.append(step.heading)
        return step.yaw

    def result(self) -> Result:
        """Return the result."""
        compass = self._estimator.heading
        assert compass is not None
        changes = tuple(int(code) for code in self._codes.movement if code in (0, 2))
        return Result(
            self._ride, np.array(self._headings), [*self._estimator.turns, *compass.finish()],
            changes, compass.tracker.bridged)


def follow(ride: Ride, *focals: float) -> list[Result]:
    """Follow a ride with its own focal length, and with others on the same frames."""
    followers = [Follower(ride), *(Follower(ride, focal) for focal in focals)]
    for frame in ride.frames():
        for follower in followers:
            follower.update(frame)
    return [follower.result() for follower in followers]


def truth_of(ride: Ride) -> MatchedTruth:
    stamps = np.array(ride.stamps_ns)
    return MatchedTruth(
        np.arange(len(stamps)), stamps, ride.yaw - ride.yaw[0], ride.places - ride.places[0])


def true_codes(ride: Ride, scale: float = 1.0) -> tuple[int, ...]:
    """Return the codes of the turns of the true heading, scaled by a factor."""
    codes, truth = HeadingCode(), truth_of(ride)
    headings = truth.headings * scale
    rates = np.diff(headings) / np.diff(truth.stamps_ns) * 1e9
    for heading, rate in zip(headings[1:].tolist(), rates.tolist()):
        codes.update(heading, rate)
    return tuple(int(code) for code in codes.movement if code in (0, 2))
