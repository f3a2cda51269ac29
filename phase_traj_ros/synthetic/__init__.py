# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A rendered town, drives through it with known turns, and degradations of the images.

``render(scene, camera, pose)`` is a pure function; scenes and drives are generated from seeds.
"""

from phase_traj_ros.synthetic.camera import Camera, KITTI_CAMERA, Pose, poses_from_kitti
from phase_traj_ros.synthetic.drive.bag import SPEED_TOPIC, TRUTH_TOPIC, write_drive_bag
from phase_traj_ros.synthetic.drive.drive import (
    Drive,
    plan_drive,
    pose_drive,
    render_drive,
    TrueTurn,
)
from phase_traj_ros.synthetic.drive.named import DRIVES, named_drive, town_drive
from phase_traj_ros.synthetic.drive.plan import Straight, Turn
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.synthetic.town.ready import CLEARANCE, scene_along, street_grid
from phase_traj_ros.synthetic.view.renderer import render

__all__ = [
    'CLEARANCE',
    'Camera',
    'DRIVES',
    'Drive',
    'KITTI_CAMERA',
    'Pose',
    'SPEED_TOPIC',
    'Scene',
    'Straight',
    'TRUTH_TOPIC',
    'TrueTurn',
    'Turn',
    'named_drive',
    'plan_drive',
    'pose_drive',
    'poses_from_kitti',
    'render',
    'render_drive',
    'scene_along',
    'street_grid',
    'town_drive',
    'write_drive_bag',
]
