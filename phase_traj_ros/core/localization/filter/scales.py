# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Limits the certainty of the scales to what the distances between turns tell."""

import math

import numpy as np
from phase_traj_ros.core.localization.filter.hypotheses import Hypotheses
from phase_traj_ros.core.localization.filter.strides import Stride
from phase_traj_ros.core.localization.given import ScaleRange
from phase_traj_ros.core.localization.settings import LocatorSettings


class ScaleCorrection:
    """
    Widens the scales of the hypotheses after each turn.

    At a turn, the position along the road is known within some metres, since vehicles use
    different lanes and cut corners. So the distance between two turns determines the scale, less
    accurately than the filter assumes. The distance to the first turn does not: the drive may
    have begun anywhere.
    """

    def __init__(self, scale: ScaleRange, settings: LocatorSettings) -> None:
        """Start with the prior ``scale``, before the first turn."""
        self._middle, self._variance = math.log(scale.middle), scale.log_deviation ** 2
        self._settings = settings
        self._turned = self._since = self._unobserved = 0.0

    def interrupt(self, variance: float) -> None:
        """Take an unobserved motion, with the variance of its distance in square metres."""
        self._turned = 0.0
        self._unobserved += variance

    def follow(self, hypotheses: Hypotheses, stride: Stride, metres: float) -> int:
        """
        Take a stride of a length in metres; if it ends a turn, widen the scales in place.

        Return the number of copies of each hypothesis that cover its range of scales: 1 if no
        turn has ended.
        """
        settings = self._settings
        self._since += metres
        if stride.bend > settings.turn_over:
            self._turned += stride.turned
            return 1
        turned, self._turned = abs(self._turned), 0.0
        if turned < settings.least_turn:
            return 1
        noise = settings.position_noise_m ** 2 * self._since / 100.0
        share = noise / (noise + settings.turn_m ** 2 + self._unobserved)
        self._since = self._unobserved = 0.0
        first = np.isinf(hypotheses.known_variance)
        gained = np.maximum(1.0 / hypotheses.scale_variance - 1.0 / hypotheses.known_variance, 0.0)
        known = np.where(first, self._variance, hypotheses.known_variance)
        hypotheses.log_scale = np.where(first, self._middle, hypotheses.log_scale)
        hypotheses.scale_variance = known / (1.0 + np.where(first, 0.0, share * gained) * known)
        hypotheses.known_variance = hypotheses.scale_variance
        deviation = math.sqrt(float(np.median(hypotheses.scale_variance)))
        return max(round(deviation / settings.merge_scale), 1)
