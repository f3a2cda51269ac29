# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is published of a pair, where it could mislead those who fuse it."""

from dataclasses import replace
from types import SimpleNamespace

from odometry_pairs import gone, step, TENTH
from phase_traj_ros.core import (
    Corner,
    Direction,
    EstimatorSettings,
    Movement,
    PairStatus,
    TrajectoryEstimator,
    Update,
)
from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.odometry import Odometer
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.outputs import topics
from phase_traj_ros.ros.outputs.messages import MESSAGES
import pytest

IN_METRES = Parameters(focal_px=700.0, camera_height=1.6)


@pytest.mark.parametrize('foreseen', [0.0, 0.01])
def test_a_speed_is_published_once_and_the_pose_for_each_frame(foreseen):
    ahead = replace(step(0.0, 0.0), foreseen=foreseen)
    odometry = Odometer(HeadingPath()).update(ahead, gone(1.0), TENTH, 0.1)
    update = Update(
        0, TENTH, TENTH, None, Step(Movement.FORWARD, Direction.FORWARD), PairStatus.OK,
        Corner(1.0, 0.0, 0.0, TENTH), heading=ahead, odometry=odometry)
    made = dict(MESSAGES.of_pair(update, IN_METRES, camera_frame='camera'))
    assert 'odom' in made
    assert ('speed' in made) is (foreseen == 0.0)


@pytest.mark.parametrize(('parameters', 'transforms'), [(Parameters(), 0), (IN_METRES, 1)])
def test_a_transform_is_in_metres(monkeypatch, parameters, transforms):
    made = []
    monkeypatch.setattr(topics, 'TransformOutput', made.append)
    node = SimpleNamespace(
        create_publisher=lambda *_: SimpleNamespace(),
        create_timer=lambda *_: SimpleNamespace())
    topics.Outputs(
        node, TrajectoryEstimator(EstimatorSettings()), replace(parameters, publish_tf=True))
    assert len(made) == transforms
