# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ways of an extract as its readers return them, before they are projected."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class OsmWay:
    """
    A road of OpenStreetMap.

    nodes
        (N,) the numbers of its nodes.
    places
        (N, 2) latitude and longitude in degrees, NaN for nodes that the extract does not have.
    one_way
        1 if it is one-way as drawn, -1 against it, 0 if it is not.
    """

    nodes: NDArray[np.int64]
    places: NDArray[np.float64]
    one_way: int
