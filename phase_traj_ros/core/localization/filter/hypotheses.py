# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The hypotheses of the filter: where the vehicle may be, as arrays."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from phase_traj_ros.core.localization.roads import Complexes, Floats, Ints


@dataclass(slots=True, eq=False)
class Hypotheses:
    """
    N weighted hypotheses, in the filter at least one; each array (N,) unless stated otherwise.

    piece, offset
        Index of the directed piece of road, and the metres from its start.
    log_scale, scale_variance
        Mean and variance of the natural logarithm of the metres per unit of the odometry.
    known_variance
        ``scale_variance`` after the last turn; infinite before the first one.
    rotation, rotation_variance
        Rotation from the axes of the odometry to those of the map, in radians, and its variance.
    trail
        Positions at the ends of the last strides, (strides + 1, N), oldest first, x + iy in
        metres.
    log_weight
        Natural logarithm of the weight, not normalised.
    """

    piece: Ints
    offset: Floats
    log_scale: Floats
    scale_variance: Floats
    known_variance: Floats
    rotation: Floats
    rotation_variance: Floats
    trail: Complexes
    log_weight: Floats

    def __len__(self) -> int:
        """Return the number of hypotheses."""
        return len(self.piece)

    def take(self, chosen: Ints) -> 'Hypotheses':
        """Return the hypotheses with the given indices."""
        return Hypotheses(*(
            getattr(self, each.name).take(chosen, axis=-1) for each in fields(self)))

    def joined(self, *others: 'Hypotheses') -> 'Hypotheses':
        """Return these hypotheses, followed by others."""
        return Hypotheses(*(
            np.concatenate([getattr(part, each.name) for part in (self, *others)], axis=-1)
            for each in fields(self)))

    @property
    def positions(self) -> Complexes:
        """Return the positions at the end of the last stride, x + iy in metres, (N,)."""
        positions: Complexes = self.trail[-1]
        return positions

    @property
    def log_total(self) -> float:
        """Return the logarithm of the sum of all weights; -inf without hypotheses."""
        if not len(self):
            return -np.inf
        most = float(self.log_weight.max())
        return most + float(np.log(np.exp(self.log_weight - most).sum()))

    def displaced(self, by: complex) -> Complexes:
        """Return the positions after a displacement of the odometry, x + iy in metres, (N,)."""
        positions: Complexes = displaced(self.positions, by, self.log_scale, self.rotation)
        return positions


def displaced(position: Any, by: Any, log_scale: Any, rotation: Any) -> Any:
    """
    Return positions on the map after displacements of the odometry; scalars or arrays.

    ``position`` is x + iy in metres, ``by`` in the axes and the unit of the odometry.
    """
    return position + by * np.exp(log_scale + 1j * rotation)


def wrapped(angle: Floats) -> Floats:
    """Return angles in radians, wrapped to -pi to pi."""
    # Several times faster than the remainder.
    result: Floats = angle - 2 * np.pi * np.rint(angle / (2 * np.pi))
    return result
