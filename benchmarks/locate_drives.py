# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the localisation study: maps, drives with noise, and the truth on the map."""

from __future__ import annotations

from dataclasses import dataclass
import json
import math
import os
from pathlib import Path

from clips import kitti_root
import numpy as np
from phase_traj_ros.core import OdometryStep, RoadMap
from phase_traj_ros.synthetic import poses_from_kitti

DRIVABLE = {
    f'{kind}{link}' for link in ('', '_link')
    for kind in ('motorway', 'trunk', 'primary', 'secondary', 'tertiary')
} | {'unclassified', 'residential', 'living_street', 'road', 'service'}


def maps_root() -> Path:
    """Return the folder of the maps."""
    beside = Path(__file__).resolve().parents[2] / 'shared' / 'maps'
    return Path(os.environ.get('PHASE_TRAJ_MAPS', beside))


def read_map(name: str, mirrored: bool = False):
    import osmium

    ways, rules, index, nodes = [], [], {}, []
    for way in osmium.FileProcessor(maps_root() / f'{name}.osm.pbf').with_locations():
        if not way.is_way() or way.tags.get('highway') not in DRIVABLE:
            continue
        if way.tags.get('area') == 'yes':
            continue
        refs = []
        for node in way.nodes:
            if not node.location.valid():
                continue
            if node.ref not in index:
                index[node.ref] = len(nodes)
                nodes.append((node.location.lat, node.location.lon))
            refs.append(index[node.ref])
        ways.append(refs)
        one = way.tags.get('oneway')
        rules.append(1 if one in ('yes', '1', 'true') or way.tags.get('junction') == 'roundabout' else -1 if one == '-1' else 0)
    degrees = np.array(nodes)
    middle = (degrees.min(axis=0) + degrees.max(axis=0)) / 2
    metres = project(degrees, middle)
    if mirrored:
        metres[:, 0] *= -1
        rules = rules
    return RoadMap.from_ways(metres, ways, rules), middle


def project(degrees, middle):
    lat, lon = np.radians(np.asarray(degrees) - middle).T
    phi = math.radians(middle[0])
    a, e2 = 6378137.0, 0.00669437999014
    w = 1 - e2 * math.sin(phi) ** 2
    north = a * (1 - e2) / w ** 1.5
    east = a / math.sqrt(w) * math.cos(phi)
    return np.stack([lon * east, lat * north], axis=1)


def true_poses(sequence: str):
    root = kitti_root()
    return poses_from_kitti(np.loadtxt(root / 'poses' / f'{sequence}.txt'))[:, :3]


def on_map(sequence: str, poses, middle):
    """Return poses in the map: x, y east north, heading."""
    given = json.loads((maps_root() / 'reference.json').read_text())[sequence]
    start = project([[given['latitude'], given['longitude']]], middle)[0]
    turn = math.pi / 2 - math.radians(given['bearing_deg'])
    c, s = math.cos(turn), math.sin(turn)
    xy = poses[:, :2] @ np.array([[c, s], [-s, c]]) + start
    return np.column_stack([xy, poses[:, 2] + turn])


def noisy_steps(poses, rng, *, heading=1.0, drift=1.0, scale=0.05):
    """Steps from true poses with noise: heading 0.4 deg/100 m and 0.02 deg/frame."""
    d = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    yaw = np.diff(poses[:, 2])
    yaw = (yaw + np.pi) % (2 * np.pi) - np.pi
    forward = np.cos(poses[:-1, 2] + yaw / 2) * np.diff(poses[:, 0]) + np.sin(
        poses[:-1, 2] + yaw / 2) * np.diff(poses[:, 1])
    d = np.copysign(d, forward)
    n = len(d)
    way = np.abs(d)
    bad = heading * np.radians(0.4) * np.sqrt(way / 100) * rng.standard_normal(n)
    jitter = heading * np.radians(0.02) * rng.standard_normal(n + 1)
    yaw = yaw + bad + np.diff(jitter)
    rate = drift * 0.015 * np.sqrt(way / 100) * rng.standard_normal(n)
    log = rng.normal(0, scale) + np.cumsum(rate)
    dist = d * np.exp(log)
    return [OdometryStep(stamp_ns=i * 100_000_000, distance=float(a), yaw=float(b)) for i, (a, b) in enumerate(zip(dist, yaw))]


def own_steps(sequence, unit=False):
    data = np.load(f'/work/notes/odometry/{sequence}.npz')
    rows = data['rows']
    h = data['height'] if unit else 1.0
    return [OdometryStep(
        stamp_ns=int(s), distance=float(r[0] / h), yaw=float(r[5]),
        distance_variance=float(max(r[1] - (r[2]**2 + r[3]**2 + r[4]**2) * r[0]**2, 0) / h**2),
        yaw_variance=float(r[6])) for s, r in zip(data['stamps_ns'][1:], rows)]
