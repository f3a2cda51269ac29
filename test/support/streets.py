# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Small road maps, and drives on them with the odometry of a vehicle."""

from itertools import pairwise
import math

import numpy as np
from phase_traj_ros.core import MapLocator, OdometryStep, Prior, RoadMap


class Town:
    """A grid of streets whose spacings are all different, with a few streets missing."""

    def __init__(self, size=7, *, seed=3, even=False):
        rng = np.random.default_rng(seed)
        spacing = np.full((2, size), 100.0) if even else rng.uniform(60, 160, (2, size))
        x, y = np.cumsum(spacing, axis=1)
        self.nodes = np.array([(a, b) for a in x for b in y])
        if not even:
            self.nodes += rng.uniform(-15, 15, self.nodes.shape)
        number = np.arange(size * size).reshape(size, size)
        streets = [
            *np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2),
            *np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)]
        self.streets = [
            tuple(map(int, street)) for street in streets if even or rng.random() > 0.12]
        self.roads = RoadMap.from_ways(self.nodes, self.streets)
        self.beside = {node: set() for node in range(len(self.nodes))}
        for a, b in self.streets:
            self.beside[a].add(b)
            self.beside[b].add(a)

    def walk(self, count, *, seed=0):
        """Return the corners of a drive of so many streets that never turns back, (N, 2)."""
        return self.nodes[self.way(count, seed=seed)]

    def way(self, count, *, seed=0):
        """Return the numbers of the nodes of this drive."""
        rng = np.random.default_rng(seed)
        way = [int(rng.integers(len(self.nodes)))]
        while len(way) <= count:
            ahead = sorted(self.beside[way[-1]] - set(way[-2:-1]))
            if not ahead:
                return self.way(count, seed=seed + 1000)
            way.append(int(rng.choice(ahead)))
        return way


def drive(corners, *, radius=6.0):
    """Return poses, (N, 3), each metre along a polyline whose corners are cut."""
    corners = np.asarray(corners, float)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    at = np.arange(0.0, way[-1], 0.25)
    points = np.stack([np.interp(at, way, column) for column in corners.T], axis=1)
    wide = int(radius / 0.25)
    kernel = np.ones(wide) / wide
    smooth = np.stack([np.convolve(column, kernel, 'valid') for column in points.T], axis=1)[::4]
    ahead = np.gradient(smooth, axis=0)
    return np.column_stack([smooth, np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))])


def steps_of(poses, *, scale=1.0, seed=None):
    """Return the odometry of poses; its unit is 1 / scale metres, and a seed draws noise."""
    rng = np.random.default_rng(seed)
    steps = []
    for number, (before, after) in enumerate(pairwise(poses)):
        step = OdometryStep.between(tuple(before), tuple(after), stamp_ns=number * 100_000_000)
        noisy = rng.normal(0.0, [0.02, math.radians(0.05)]) if seed is not None else (0.0, 0.0)
        steps.append(OdometryStep(
            stamp_ns=step.stamp_ns, distance=(step.distance + noisy[0]) / scale,
            yaw=step.yaw + noisy[1]))
    return steps


def follow(locator: MapLocator, steps):
    """Return the estimates of a locator after each step."""
    return [locator.update(step) for step in steps]


def errors(estimates, poses):
    """Return the distance of each estimate from the truth in metres."""
    return np.array([
        math.hypot(each.x - x, each.y - y) for each, (x, y, _) in zip(estimates, poses[1:])])


def on_map(town):
    """Return a locator that knows that the vehicle is on the map: the first turns locate it."""
    return MapLocator(town.roads, prior=Prior(*town.nodes.mean(axis=0), 5000.0))


def claimed(estimates):
    """Return whether the place is claimed in each estimate, (N,)."""
    return np.array([each.claimed for each in estimates])


def located(estimates):
    """Return the number of the first estimate that is claimed, or None."""
    return next((number for number, each in enumerate(estimates) if each.claimed), None)
