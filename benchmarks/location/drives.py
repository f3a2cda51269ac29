# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the localisation study: maps, drives, and the truth on the map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
import json
import math
import os
from pathlib import Path

from benchmarks.shared.clips import kitti_poses
import numpy as np
import osmium
from phase_traj_ros.core import LinkCode, OdometryStep, RoadMap
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.synthetic import poses_from_kitti
from phase_traj_ros.tasks.evaluation.scores import way_along
from phase_traj_ros.tasks.location.odometry import steps_of_links

SEQUENCES = ('00', '02', '04', '06', '08', '09', '10')
HERE, ELSEWHERE = 'Karlsruhe', 'Kaiserslautern'
MIRRORED, PARTLY = 'Karlsruhe, mirrored', 'Karlsruhe, every tenth road missing'
MISSING = 'Karlsruhe, roads of the drive missing'
ELSEWHERE_MIRRORED = 'Kaiserslautern, mirrored'
LARGE = 'Karlsruhe and Kaiserslautern, both also mirrored'
# What the study keeps.
OUT = Path(__file__).resolve().parents[2] / 'out' / 'locate'
# A way of the map counts as driven if a node of it is this close to the drive, in metres.
_DRIVEN_M = 60.0
# Noise of the drawn odometry: heading per root of 100 m and per frame, and distance: the scale,
# and its drift per root of 100 m.
_HEADING, _FRAME = math.radians(0.4), math.radians(0.02)
_SCALE, _DRIFT = 0.05, 0.015
# Links of the bare code, in metres.
LINK_M = 10.0


@dataclass(frozen=True, eq=False)
class Town:
    """A road map, and how it lies on the earth."""

    roads: RoadMap
    projection: LocalProjection


def maps_root() -> Path:
    """Return the folder of the maps."""
    beside = Path(__file__).resolve().parents[3] / 'shared' / 'maps'
    return Path(os.environ.get('PHASE_TRAJ_MAPS', beside))


@cache
def town(name: str) -> Town:
    """Return one of the maps by its name above."""
    file = read_roads(
        large_map() if name == LARGE
        else maps_root() / f'{name.partition(",")[0].lower()}.osm.pbf')
    nodes, ways, rules = file.nodes, [way.tolist() for way in file.ways], list(file.one_way)
    if name in (MIRRORED, ELSEWHERE_MIRRORED):
        nodes = nodes * (-1.0, 1.0)
    if name == PARTLY:
        kept = np.random.default_rng(0).random(len(ways)) > 0.1
        ways = [way for way, stays in zip(ways, kept) if stays]
        rules = [rule for rule, stays in zip(rules, kept) if stays]
    return Town(RoadMap.from_ways(nodes, ways, rules), file.projection)


@cache
def large_map() -> Path:
    """Return a map of 110 km²: both towns and their mirror images, side by side."""
    path = OUT / 'large.osm.pbf'
    if path.exists():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    south, west, _, _ = read_roads(maps_root() / f'{HERE.lower()}.osm.pbf').bounds
    writer = osmium.SimpleWriter(str(path))
    # A file has all nodes before the ways.
    for kind in ('node', 'way'):
        edge = west
        for number, name in enumerate((HERE, HERE, ELSEWHERE, ELSEWHERE)):
            file = maps_root() / f'{name.lower()}.osm.pbf'
            first, left, _, right = read_roads(file).bounds
            mirrored, shift = number % 2 == 1, number * 10 ** 11
            for thing in osmium.FileProcessor(str(file)):
                if kind == 'node' and thing.is_node():
                    lon = right - thing.lon if mirrored else thing.lon - left
                    writer.add_node(thing.replace(
                        id=thing.id + shift, location=(edge + lon, thing.lat - first + south)))
                elif kind == 'way' and thing.is_way():
                    writer.add_way(thing.replace(
                        id=thing.id + shift, nodes=[node.ref + shift for node in thing.nodes]))
            edge += right - left
    writer.close()
    return path


def without_driven(truth: np.ndarray) -> RoadMap:
    """Return the map of Karlsruhe without the ways near true poses (N, 3) on it."""
    file = read_roads(maps_root() / f'{HERE.lower()}.osm.pbf')
    near = np.array([
        np.hypot(*(truth[::5, :2] - node).T).min() < _DRIVEN_M for node in file.nodes])
    kept = [
        (way.tolist(), rule) for way, rule in zip(file.ways, file.one_way) if not near[way].any()]
    return RoadMap.from_ways(file.nodes, *map(list, zip(*kept)))


@cache
def true_poses(sequence: str) -> np.ndarray:
    """Return the poses of a sequence: x, y and yaw, (N, 3), in the axes of its first frame."""
    matrices = kitti_poses(sequence)
    assert matrices is not None
    return poses_from_kitti(matrices)[:, :3]


def way_of(poses: np.ndarray) -> np.ndarray:
    """Return the metres travelled at each pose, (N,)."""
    return way_along(poses[:, :2])


def on_map(sequence: str, name: str = HERE) -> np.ndarray | None:
    """Return the true poses on a map with Karlsruhe, or None if nobody measured them."""
    given = json.loads((maps_root() / 'reference.json').read_text()).get(sequence)
    if given is None:
        return None
    start = town(name).projection.to_metres([given['latitude']], [given['longitude']])[0]
    turn = math.pi / 2 - math.radians(given['bearing_deg'])
    return moved(true_poses(sequence), turn, start)


def stretch(
    poses: np.ndarray, start: float, length: float, *, back: bool = False,
) -> np.ndarray:
    """Return the poses of a part of a drive, from metres after its start; ``back`` turns it."""
    first, last = np.searchsorted(way_of(poses), [start, start + length])
    those = poses[first:last]
    return those[::-1] + np.array([0.0, 0.0, math.pi]) if back else those


def with_straight(poses: np.ndarray, first: float, straight: float) -> np.ndarray:
    """Return poses (N, 3) with a straight way of so many metres after the first metres."""
    cut = np.searchsorted(way_of(poses), first)
    ahead = np.array([math.cos(poses[cut, 2]), math.sin(poses[cut, 2]), 0.0])
    between = poses[cut] + np.arange(1.0, straight + 1.0)[:, None] * ahead
    return np.concatenate([poses[:cut + 1], between, poses[cut + 1:] + straight * ahead])


def moved(poses: np.ndarray, turn: float, start: np.ndarray) -> np.ndarray:
    """Return poses turned by an angle, and then moved."""
    cos, sin = math.cos(turn), math.sin(turn)
    places = poses[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + start
    return np.column_stack([places, poses[:, 2] + turn])


def noisy(
    sequence: str, seed: int, *, heading: float = 1.0, drift: float = 1.0,
) -> list[OdometryStep]:
    """Return the odometry of the true poses of a sequence with drawn noise."""
    rng = np.random.default_rng((seed, int(sequence)))
    return with_noise(true_poses(sequence), rng, heading=heading, drift=drift)


def with_noise(
    poses: np.ndarray, rng: np.random.Generator, *, heading: float = 1.0, drift: float = 1.0,
) -> list[OdometryStep]:
    """Return the odometry of poses with drawn noise, which tells the variances of its drifts."""
    exact = [
        OdometryStep.between(tuple(before), tuple(after), stamp_ns=number * 100_000_000)
        for number, (before, after) in enumerate(pairwise(poses))]
    length = np.array([step.distance for step in exact])
    share = np.sqrt(np.abs(length) / 100.0)
    yaw = np.array([step.yaw for step in exact])
    yaw += heading * (
        _HEADING * share * rng.standard_normal(len(yaw))
        + _FRAME * np.diff(rng.standard_normal(len(yaw) + 1)))
    log_scale = rng.normal(0.0, _SCALE) + np.cumsum(
        drift * _DRIFT * share * rng.standard_normal(len(yaw)))
    length *= np.exp(log_scale)
    variance = heading ** 2 * (_HEADING ** 2 * share ** 2 + _FRAME ** 2)
    return [
        OdometryStep(
            stamp_ns=step.stamp_ns, distance=float(metres), yaw=float(turn),
            yaw_variance=float(told), scale_variance=float(drifted))
        for step, metres, turn, told, drifted in zip(
            exact, length, yaw, variance, (drift * _DRIFT * share) ** 2)]


def own(file: Path, *, metric: bool = True) -> list[OdometryStep]:
    """Return recorded odometry of this package, in metres or in heights of the camera."""
    data = np.load(file)
    unit = 1.0 if metric else float(data['height'])
    steps = []
    for stamp_ns, row in zip(data['stamps_ns'][1:].tolist(), data['rows']):
        distance, variance, _, _, _, yaw, yaw_variance = row[:7].tolist()
        steps.append(OdometryStep(
            stamp_ns=stamp_ns, distance=distance / unit, yaw=yaw, yaw_variance=yaw_variance,
            distance_variance=variance / unit ** 2))
    return steps


def coded(sequence: str) -> tuple[list[OdometryStep], list[int]]:
    """Return the steps that a code of equal links says, and the frame that each link ends in."""
    code = LinkCode(LINK_M, connectivity=8)
    links, frames, heading = [], [], 0.0
    for number, (first, second) in enumerate(pairwise(true_poses(sequence))):
        exact = OdometryStep.between(tuple(first), tuple(second), stamp_ns=0)
        heading += exact.yaw
        added = code.add(exact.distance, heading, exact.yaw)
        links += [each.value for each in added]
        frames += [number + 1] * len(added)
    return steps_of_links(links, 8, LINK_M), frames
