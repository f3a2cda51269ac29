# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A small irregular town, and drives through it."""

import math

import numpy as np
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.write_osm import write_osm

PLANE = LocalProjection(49.0, 8.4)
SIDE = 7


def corners(seed=3, spacing=110.0):
    """Return the crossings of an irregular grid of 7 by 7 streets, (7, 7, 2), in metres."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE), indexing='ij'), axis=-1)
    return (grid - (SIDE - 1) / 2) * spacing + rng.uniform(-35.0, 35.0, (SIDE, SIDE, 2))


def town_lines(seed=3):
    """Return the centre lines of the streets."""
    at = corners(seed)
    return [at[row] for row in range(SIDE)] + [at[:, column] for column in range(SIDE)]


def write_town(path, seed=3):
    """Write the town as an .osm; return its path."""
    write_osm(town_lines(seed), path, projection=PLANE)
    return path


ROUTE = ((0, 1), (1, 1), (2, 1), (2, 2), (3, 2), (3, 1), (4, 1), (4, 2), (4, 3), (3, 3), (2, 3),
         (2, 4), (2, 5), (3, 5), (4, 5), (5, 5), (5, 4), (5, 3), (6, 3))


def drive(route=ROUTE, *, seed=3, step=0.8):
    """Return a drive along crossings, (N, 3): x, y in metres and yaw in radians, ENU."""
    at = corners(seed)
    line = np.stack([at[place] for place in route])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    places = np.arange(0.0, along[-1], step)
    sharp = np.stack([np.interp(places, along, each) for each in line.T], axis=1)
    # Corners are cut, as vehicles do.
    width = round(12.0 / step) | 1
    padded = np.pad(sharp, ((width // 2, width // 2), (0, 0)), mode='edge')
    smooth = np.stack(
        [np.convolve(each, np.full(width, 1 / width), mode='valid') for each in padded.T], axis=1)
    yaw = np.unwrap(np.arctan2(*np.gradient(smooth, axis=0).T[::-1]))
    return np.column_stack([smooth, yaw])


def write_tum(poses, path, *, start=1_700_000_000, interval=0.1, turned=0.7, scale=1.0):
    """Write a drive in the TUM format, from another origin and heading; return its path."""
    cosine, sine = math.cos(turned), math.sin(turned)
    interval_ns = round(interval * 1e9)
    lines = ['# stamp x y z qx qy qz qw']
    for number, (x, y, yaw) in enumerate(poses.tolist()):
        x, y = (x - poses[0, 0]) * scale, (y - poses[0, 1]) * scale
        half = (yaw + turned) / 2
        seconds, rest = divmod(number * interval_ns, 10**9)
        lines.append(
            f'{start + seconds}.{rest:09d} {cosine * x - sine * y:.6f}'
            f' {sine * x + cosine * y:.6f} 0 0 0 {math.sin(half):.9f} {math.cos(half):.9f}')
    path.write_text('\n'.join([*lines, '']))
    return path
