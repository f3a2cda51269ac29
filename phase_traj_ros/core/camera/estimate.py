# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimates of a camera that is learned from drives."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon, HorizonEstimator
from phase_traj_ros.core.camera.lens_family import OneNumberLens, PINHOLE
from phase_traj_ros.core.camera.tuning import TUNING

# A normal distribution has 90 % within this many standard deviations.
_90_PERCENT = 1.645


@dataclass(frozen=True, slots=True)
class FieldOfView:
    """A horizontal field of view that was learned."""

    hfov_deg: float
    """Most likely field of view in degrees, from edge to edge."""
    deviation_deg: float
    """Its standard deviation in degrees."""
    sureness: float
    """Probability that the focal length is correct within 5 %, 0 to 1."""
    turns: int
    """Number of turns, or parts of turns, used for the estimate."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraEstimate:
    """
    An estimate of a camera for images of one size.

    Raises
    ------
    ValueError
        A number is out of its range.

    """

    width: int
    """Width of the images in pixels."""
    height: int
    """Height of the images in pixels."""
    focal_px: float
    """Focal length in pixels per radian at the principal point."""
    focal_deviation: float
    """Standard deviation of its logarithm, the relative deviation of the focal length."""
    straightness: float = PINHOLE
    """Straightness: 1 for a pinhole, 0 for an equidistant fisheye (see ``lens_family``)."""
    straightness_deviation: float = 0.0
    """Its standard deviation."""
    column_px: float = 0.0
    """Column of the principal point, in pixels to the right of the image centre."""
    column_deviation_px: float = 0.0
    """Its standard deviation."""
    pitch_deg: float = 0.0
    """Pitch in degrees, positive down."""
    pitch_deviation_deg: float = math.degrees(Horizon().pitch_deviation)
    """Its standard deviation."""
    roll_deg: float = 0.0
    """Roll in degrees, positive right side down."""
    roll_deviation_deg: float = math.degrees(Horizon().roll_deviation)
    """Its standard deviation."""
    turns: int = 0
    """Number of turns, or parts of turns, used for the estimate."""

    def __post_init__(self) -> None:
        """Check the values."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or ('deviation' in field.name and value < 0.0):
                raise ValueError(f'{field.name} is {value}: give a finite number')
        if min(self.width, self.height) < 1:
            raise ValueError(
                f'the estimate is for images of {self.width}x{self.height} pixels: give the size'
                ' of the images it was made from')
        OneNumberLens(self.focal_px, self.straightness)

    @property
    def horizon(self) -> Horizon:
        """Return the tilt of the camera."""
        return Horizon(*map(math.radians, (
            self.pitch_deg, self.roll_deg, self.pitch_deviation_deg, self.roll_deviation_deg)))

    @property
    def hfov_deg(self) -> float:
        """Return the horizontal field of view in degrees, from edge to edge."""
        lens = OneNumberLens(self.focal_px, self.straightness)
        return lens.hfov_deg(self.width, column=self.column_px)

    @property
    def field_of_view(self) -> FieldOfView:
        """Return the horizontal field of view with its uncertainty."""
        factor = math.exp(self.focal_deviation)
        wide, narrow = (
            replace(self, focal_px=focal_px).hfov_deg
            for focal_px in (self.focal_px / factor, self.focal_px * factor))
        return FieldOfView(self.hfov_deg, (wide - narrow) / 2, self.probability, self.turns)

    @property
    def focal_interval_px(self) -> tuple[float, float]:
        """Return the 90 % interval of the focal length, in pixels."""
        factor = math.exp(_90_PERCENT * self.focal_deviation)
        return self.focal_px / factor, self.focal_px * factor

    @property
    def probability(self) -> float:
        """Return the probability that the focal length is correct within 5 %, 0 to 1."""
        if self.focal_deviation == 0.0:
            return 1.0
        return math.erf(math.log1p(0.05) / (self.focal_deviation * math.sqrt(2.0)))


def combined(estimates: Sequence[CameraEstimate]) -> CameraEstimate:
    """
    Combine the estimates of one or more recordings of one camera.

    The images may differ in size, but not in aspect ratio. The result is for the size of the
    first.

    Raises
    ------
    ValueError
        The images have different aspect ratios.

    """
    first = estimates[0]
    for other in estimates[1:]:
        if abs(other.width * first.height - first.width * other.height) > max(
                first.width, other.width):
            raise ValueError(
                f'images of {other.width}x{other.height} and of {first.width}x{first.height}'
                ' pixels are not of one camera: give recordings of one')
    scales = [first.width / each.width for each in estimates]
    log_focal, deviation = _mean(
        [(math.log(each.focal_px * scale), each.focal_deviation)
         for each, scale in zip(estimates, scales)], TUNING.common_error)
    straightness, straightness_deviation = _mean(
        [(each.straightness, each.straightness_deviation) for each in estimates],
        TUNING.common_error)
    column, column_deviation = _mean(
        [(each.column_px * scale, each.column_deviation_px * scale)
         for each, scale in zip(estimates, scales)], 0.0)
    horizon = HorizonEstimator()
    for each in estimates:
        horizon.add(each.horizon)
    return CameraEstimate(
        width=first.width, height=first.height, focal_px=math.exp(log_focal),
        focal_deviation=deviation, straightness=straightness,
        straightness_deviation=straightness_deviation,
        column_px=column, column_deviation_px=column_deviation,
        **horizon.horizon.degrees(),
        turns=sum(each.turns for each in estimates))


def _mean(estimates: Sequence[tuple[float, float]], common: float) -> tuple[float, float]:
    """
    Return the mean of values with deviations, and its deviation.

    ``common`` is the deviation that does not average out.
    """
    values, deviations = np.array(estimates).T
    weights = 1.0 / np.maximum(np.square(deviations) - common ** 2, 1e-6)
    mean = np.average(values, weights=weights)
    # If the values scatter more than their deviations, the result is less certain.
    spread = weights @ np.square(values - mean) / max(len(values) - 1, 1)
    return float(mean), math.sqrt(max(1.0, spread) / weights.sum() + common ** 2)
