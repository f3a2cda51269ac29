# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The likelihood of the hypotheses by the bends of their roads, and the null hypothesis."""

import math

import numpy as np
from phase_traj_ros.core.localization.hypotheses import Hypotheses, wrapped
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import bend_of, Stride


def judge(hypotheses: Hypotheses, stride: Stride, settings: LocatorSettings) -> float:
    """
    Weigh the hypotheses by the direction of their newest chord, and correct their rotations.

    Return how well they fit on average: the likelihood of their chords, relative to its peak.

    The difference of the chords is normally distributed, with a share of outliers. Each rotation
    has a Kalman filter, in which an outlier counts by the probability that it is not one.
    """
    chord = np.angle(hypotheses.trail[-1] - hypotheses.trail[0])
    off = wrapped(chord - stride.chord - hypotheses.turned)
    noise = settings.chord_error ** 2 + settings.bend_error ** 2 * (
        stride.bend ** 2 + bend_of(hypotheses.trail) ** 2)
    variance = hypotheses.variance + noise
    beyond = np.maximum(np.abs(off) - settings.dead_band, 0.0)
    peak = (1.0 - settings.outlier_share) / np.sqrt(2 * np.pi * variance)
    fitting = np.exp(-beyond ** 2 / (2 * variance)) * peak
    outlier = settings.outlier_share / (2 * np.pi)
    total = fitting + outlier
    weight = np.exp(hypotheses.log_weight - hypotheses.log_weight.max(initial=-np.inf))
    fit = float((weight * (total / (peak + outlier))).sum() / max(weight.sum(), 1.0))
    hypotheses.log_weight = hypotheses.log_weight + settings.tempering * np.log(total)
    # Overlapping chords share their errors, so each counts as little here as it does above.
    gain = fitting / total * hypotheses.variance / (
        hypotheses.variance + noise / settings.tempering)
    hypotheses.turned = hypotheses.turned + gain * off
    hypotheses.variance = hypotheses.variance * (1.0 - gain)
    return fit


class NullRoad:
    """
    The hypothesis that the vehicle is on no road of the map.

    Such a road bends as the odometry does, but it has to pay for its turns: a road of the map has
    them where the map says so. It fits as those of the map do on average: neither a long straight,
    on which any of them fits, nor a coarse map proves anything.
    """

    def __init__(self, settings: LocatorSettings) -> None:
        """Start with the weight of the settings."""
        self._settings = settings
        self._variance = settings.start_heading ** 2
        self._fit = self._way = 0.0
        self.log_weight = math.log(settings.null_share)
        """Natural logarithm of its weight."""
        self.log_fit = 0.0
        """Natural logarithm of the likelihood of a road that fits, since the start..."""
        self.turned = 0.0
        """...and the angle of the turns that this one has paid for."""

    @property
    def log_alone(self) -> float:
        """Return what its weight would be if it had been the only one: nobody came or left."""
        return self.log_fit - self._settings.null_turn * self.turned

    def take(self, log_fit: float) -> None:
        """Weigh the null hypothesis by a measurement of so much likelihood, in nats."""
        self.log_fit += log_fit
        self.log_weight += log_fit

    def follow(self, stride: Stride, metres: float, fit: float) -> None:
        """Weigh the null hypothesis by a stride of so many metres; ``fit`` is that of the map."""
        settings = self._settings
        self._way = min(self._way + metres, settings.null_fit_m)
        self._fit += (fit - self._fit) * min(metres / self._way, 1.0)
        self._variance += settings.heading_noise ** 2 * metres / 100.0 + stride.yaw_variance
        noise = settings.chord_error ** 2 + 2 * settings.bend_error ** 2 * stride.bend ** 2
        fitting = (1.0 - settings.outlier_share) * max(self._fit, settings.null_fit) / (
            math.sqrt(2 * math.pi * (self._variance + noise)))
        turned = max(abs(stride.turned) - settings.null_straight, 0.0)
        log_fit = settings.tempering * math.log(
            fitting + settings.outlier_share / (2 * math.pi))
        self.take(log_fit)
        self.turned += turned
        self.log_weight -= settings.null_turn * turned
        self._variance *= 1.0 - self._variance / (self._variance + noise / settings.tempering)
