# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How well the roads of the hypotheses bend as the odometry does."""

import numpy as np
from phase_traj_ros.core.localization.hypotheses import Hypotheses
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Stride


def judge(
    them: Hypotheses, stride: Stride, settings: LocatorSettings, bend_error: float,
) -> float:
    """
    Weigh the hypotheses by the direction of their newest chord, and correct their rotations.

    The difference of the chords is normally distributed, with a share of outliers. Each rotation
    has a Kalman filter, in which an outlier counts by the probability that it is not one.

    A vehicle that is not on the map has driven a road that bends exactly as the odometry does. It
    pays for its turns as much as the best of many wrong roads loses at them. What a hypothesis
    gains on it is evidence that the vehicle is on the map. Returns the mean logarithm of the
    likelihood on such a road.
    """
    parts = np.diff(them.trail, axis=1)
    chord = np.angle(them.trail[:, -1] - them.trail[:, 0])
    bend = np.abs(np.angle(parts[:, 1:] * parts[:, :-1].conj())).sum(axis=1)
    off = np.remainder(chord - stride.chord - them.turned + np.pi, 2 * np.pi) - np.pi
    noise = settings.chord_error ** 2 + bend_error ** 2 * (stride.bend ** 2 + bend ** 2)
    variance = them.variance + noise
    beyond = np.maximum(np.abs(off) - settings.dead_band, 0.0)
    fitting = (1.0 - settings.outlier_share) * np.exp(-beyond ** 2 / (2 * variance)) / np.sqrt(
        2 * np.pi * variance)
    total = fitting + settings.outlier_share / (2 * np.pi)
    log_fit = settings.tempering * np.log(total)
    them.log_weight = them.log_weight + log_fit
    exact = settings.chord_error ** 2 + 2 * bend_error ** 2 * stride.bend ** 2
    peak = (1.0 - settings.outlier_share) / np.sqrt(2 * np.pi * (them.variance + exact))
    turned = max(abs(stride.turned) - settings.straight_turn, 0.0)
    best_fit = settings.tempering * np.log(peak + settings.outlier_share / (2 * np.pi))
    them.evidence = np.minimum(
        them.evidence + log_fit - best_fit + settings.turn_price * turned, settings.most_evidence)
    # Overlapping chords share their errors, so each counts as little here as it does above.
    gain = fitting / total * them.variance / (them.variance + noise / settings.tempering)
    them.turned = them.turned + gain * off
    them.variance = them.variance * (1.0 - gain)
    return float(best_fit.mean()) if len(them) else 0.0
