# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A real drive on a real map: the true poses of KITTI 00 with the noise of an odometry."""

import json
import math

import numpy as np
from phase_traj_ros.core import MapLocator
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.synthetic import poses_from_kitti
from streets import errors, follow, located, steps_of

FRAMES = 1200


def test_a_real_drive_is_located(kitti_root, maps_root):
    town = read_roads(maps_root / 'kitti_00_part.osm.bz2')
    poses = poses_from_kitti(np.loadtxt(kitti_root / 'poses' / '00.txt')[:FRAMES])[:, :3]
    estimates = follow(MapLocator(town.road_map), steps_of(poses, seed=1))

    given = json.loads((maps_root / 'reference.json').read_text())['00']
    start = town.projection.to_metres([given['latitude']], [given['longitude']])[0]
    turn = math.pi / 2 - math.radians(given['bearing_deg'])
    places = np.exp(1j * turn) * (poses[:, 0] + 1j * poses[:, 1]) + complex(*start)
    truth = np.column_stack([places.real, places.imag, poses[:, 2] + turn])
    first = located(estimates)
    assert first is not None
    assert np.median(errors(estimates, truth)[first:]) < 6.0
    assert errors(estimates, truth)[first:].max() < 50.0
