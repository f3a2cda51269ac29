# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The likelihood of the hypotheses given the bends of their roads, and the null hypothesis."""

import math

import numpy as np
from phase_traj_ros.core.localization.filter.hypotheses import Hypotheses, wrapped
from phase_traj_ros.core.localization.filter.strides import bend_of, Stride
from phase_traj_ros.core.localization.settings import LocatorSettings


def weigh(hypotheses: Hypotheses, stride: Stride, settings: LocatorSettings) -> float:
    """
    Update the weights and the rotations, in place, by the newest chord.

    The difference between the chord of the road and that of the odometry is normally distributed,
    with a share of outliers. A Kalman filter per hypothesis corrects the rotation, scaled by the
    probability that the chord is not an outlier.

    Return the mean fit: the weighted mean of the likelihood relative to its peak, 0 to 1.
    """
    chord = np.angle(hypotheses.trail[-1] - hypotheses.trail[0])
    off = wrapped(chord - stride.chord - hypotheses.rotation)
    noise = settings.chord_error ** 2 + settings.bend_error ** 2 * (
        stride.bend ** 2 + bend_of(hypotheses.trail) ** 2)
    variance = hypotheses.rotation_variance + noise
    beyond = np.maximum(np.abs(off) - settings.dead_band, 0.0)
    peak = (1.0 - settings.outlier_share) / np.sqrt(2 * np.pi * variance)
    fitting = np.exp(-beyond ** 2 / (2 * variance)) * peak
    outlier = settings.outlier_share / (2 * np.pi)
    total = fitting + outlier
    weight = np.exp(hypotheses.log_weight - hypotheses.log_weight.max())
    fit = float((weight * (total / (peak + outlier))).sum() / weight.sum())
    hypotheses.log_weight = hypotheses.log_weight + settings.tempering * np.log(total)
    # Overlapping chords share their errors, so the filter is tempered like the weights.
    gain = fitting / total * hypotheses.rotation_variance / (
        hypotheses.rotation_variance + noise / settings.tempering)
    hypotheses.rotation = hypotheses.rotation + gain * off
    hypotheses.rotation_variance = hypotheses.rotation_variance * (1.0 - gain)
    return fit


class NullHypothesis:
    """
    The hypothesis that the vehicle is on no road of the map.

    It assumes an unmapped road that bends as the odometry does. Each turn costs it a penalty,
    since it does not predict where the turns are. Its fit is the mean fit of the mapped roads, so
    that neither a long straight road nor an inaccurate map favours either side. Where the vehicle
    has driven before, its weight is not updated: another lap shows nothing new.
    """

    def __init__(self, settings: LocatorSettings) -> None:
        """Start with the prior probability of the settings."""
        self._settings = settings
        self.variance = settings.start_heading ** 2
        """Variance of its heading in square radians, as those of the hypotheses."""
        self._fit = self._averaged_m = 0.0
        self.log_weight = math.log(settings.null_share)
        """Natural logarithm of its weight."""
        self.log_fit = 0.0
        """Sum of the log-likelihoods since the start, without penalties."""
        self._penalties = 0.0
        self.turned = 0.0
        """Sum of the angles turned since the start, in radians, without those of further laps."""

    @property
    def log_evidence(self) -> float:
        """Return the log-likelihood since the start, with penalties, without transitions."""
        return self.log_fit - self._penalties

    def add_log_likelihood(self, log_fit: float) -> None:
        """Update the weight by the log-likelihood of a measurement."""
        self.log_fit += log_fit
        self.log_weight += log_fit

    def follow(self, stride: Stride, metres: float, fit: float) -> None:
        """Take a stride of a length in metres; ``fit`` is that of the map."""
        settings = self._settings
        self._averaged_m = min(self._averaged_m + metres, settings.null_fit_m)
        self._fit += (fit - self._fit) * min(metres / self._averaged_m, 1.0)
        self.variance += settings.heading_noise ** 2 * metres / 100.0 + stride.yaw_variance
        noise = settings.chord_error ** 2 + 2 * settings.bend_error ** 2 * stride.bend ** 2
        fitting = (1.0 - settings.outlier_share) * max(self._fit, settings.null_fit) / (
            math.sqrt(2 * math.pi * (self.variance + noise)))
        log_fit = settings.tempering * math.log(fitting + settings.outlier_share / (2 * math.pi))
        turned = max(abs(stride.turned) - settings.null_straight, 0.0)
        penalty = settings.null_turn * turned
        self.log_fit += log_fit
        self._penalties += penalty
        if not stride.repeated:
            self.log_weight += log_fit - penalty
            self.turned += turned
        self.variance *= 1.0 - self.variance / (self.variance + noise / settings.tempering)
