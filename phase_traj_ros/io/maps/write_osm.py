# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes roads as an .osm, for synthetic maps."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.io.maps.projection import LocalProjection


def write_osm(
    lines: Sequence[NDArray[np.float64]], path: Path, *, projection: LocalProjection,
) -> None:
    """
    Write residential roads as OpenStreetMap XML.

    Parameters
    ----------
    lines
        Centre lines in metres, each (N, 2). Roads meet at points that are equal when rounded to
        millimetres.
    path
        The file to write, .osm.
    projection
        The projection of the lines.

    """
    points = np.round(np.concatenate(lines), 3) + 0.0
    nodes, of_point = np.unique(points, axis=0, return_inverse=True)
    latitudes, longitudes = projection.to_degrees(*nodes.T)
    text = ['<?xml version="1.0" encoding="UTF-8"?>', '<osm version="0.6">']
    text += [
        f'<node id="{number}" lat="{latitude:.9f}" lon="{longitude:.9f}"/>'
        for number, (latitude, longitude) in enumerate(zip(latitudes, longitudes), 1)]
    roads = np.split(of_point.reshape(-1) + 1, np.cumsum([len(line) for line in lines])[:-1])
    for number, road in enumerate(roads, 1):
        text.append(f'<way id="{number}">')
        text += [f'<nd ref="{node}"/>' for node in road]
        text += ['<tag k="highway" v="residential"/>', '</way>']
    path.write_text('\n'.join([*text, '</osm>', '']), encoding='utf-8')
