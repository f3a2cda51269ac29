# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Outlines of objects in a street: houses are rectangular, trees and cars are not."""

from dataclasses import dataclass
from enum import auto, Enum

import numpy as np
from phase_traj_ros.synthetic.arrays import Floats, Ints

_SAMPLES = 193


class Outline(Enum):
    """Kinds of outline."""

    SQUARE = auto()
    GABLE = auto()
    CROWN = auto()
    HEDGE = auto()
    CAR_SIDE = auto()
    CAR_END = auto()


@dataclass(frozen=True, slots=True, eq=False)
class Silhouettes:
    """
    Upper and lower edges along a panel, as shares of its height.

    ``upper``, ``lower``: (S, 193), from one end of the panel to the other; ``members``: the rows
    of each kind.
    """

    upper: Floats
    lower: Floats
    members: dict[Outline, tuple[int, ...]]

    def at(self, index: Ints, along: Floats) -> tuple[Floats, Floats]:
        """Return the upper and lower edges of silhouettes ``index`` at shares ``along``."""
        place = along * (_SAMPLES - 1)
        left = np.minimum(place.astype(np.int64), _SAMPLES - 2)
        share = place - left
        # Places in a table as one line are looked up faster than pairs of indices.
        left += index * _SAMPLES
        edges = []
        for table in (self.upper.ravel(), self.lower.ravel()):
            low = table[left]
            edges.append(low + share * (table[left + 1] - low))
        return (edges[0], edges[1])


def _ragged(rng: np.random.Generator) -> Floats:
    """Return an irregular line of mean 0 and standard deviation 1."""
    line = np.zeros(_SAMPLES)
    for (knots, weight) in ((7, 1.0), (19, 0.5), (49, 0.25), (97, 0.12)):
        line += weight * np.interp(
            np.linspace(0, 1, _SAMPLES), np.linspace(0, 1, knots), rng.standard_normal(knots))
    ragged: Floats = line / line.std()
    return ragged


def build_silhouettes(rng: np.random.Generator) -> Silhouettes:
    """Draw a few outlines of every kind."""
    x = np.linspace(-1.0, 1.0, _SAMPLES)
    flat = np.zeros(_SAMPLES)
    bow = np.sqrt(np.maximum(1.0 - x * x, 0.0))
    drawn = [(Outline.SQUARE, flat + 1.0, flat), (Outline.GABLE, 1.0 - np.abs(x), flat)]
    for _ in range(6):
        middle = rng.uniform(0.3, 0.5)
        drawn.append((
            Outline.CROWN, middle + bow * (0.93 - middle + 0.07 * _ragged(rng)),
            middle - bow * (middle - 0.07 + 0.07 * _ragged(rng))))
    drawn += [(Outline.HEDGE, 0.9 + 0.05 * _ragged(rng), flat) for _ in range(3)]
    for _ in range(3):
        (bonnet, screen) = (rng.uniform(0.58, 0.66), rng.uniform(-0.55, -0.35))
        drawn.append((Outline.CAR_SIDE, np.interp(
            x, (-1.0, screen - 0.3, screen, 0.3, rng.uniform(0.7, 0.95), 1.0),
            (0.56, bonnet, 0.97, 1.0, 0.97, 0.85)), flat))
    drawn.append((Outline.CAR_END, np.interp(
        x, (-1.0, -0.95, -0.9, -0.68, 0.68, 0.9, 0.95, 1.0),
        (0.1, 0.1, 0.58, 1.0, 1.0, 0.58, 0.1, 0.1)), flat))
    (kinds, upper, lower) = zip(*drawn)
    return Silhouettes(np.clip(upper, 0.0, 1.0), np.clip(lower, 0.0, 1.0), members={
        each: tuple(index for (index, kind) in enumerate(kinds) if kind is each)
        for each in Outline})
