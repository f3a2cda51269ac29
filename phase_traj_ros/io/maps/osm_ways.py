# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ways of an extract, as its readers return them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class OsmWay:
    """
    A way of OpenStreetMap that is a road.

    nodes
        Identifiers of its nodes in order, (N,).
    degrees
        Latitude and longitude of the nodes in degrees, (N, 2); NaN for missing nodes.
    one_way
        1 if it is one-way in the order of its nodes, -1 against it, 0 if it is not one-way.
    """

    nodes: NDArray[np.int64]
    degrees: NDArray[np.float64]
    one_way: int
