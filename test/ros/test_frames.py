# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames of what is published: odom (REP 105) where it is in metres, and only there."""

from nav_msgs.msg import Path
from phase_traj_ros.core import EstimatorSettings, TrajectoryEstimator
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.messages.topics import PATH
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.outputs.messages import MESSAGES
import pytest
from rclpy.serialization import deserialize_message


@pytest.mark.parametrize(('values', 'path', 'odometry'), [
    ({}, 'phase_traj', None),
    ({'camera_height': 1.6}, 'odom', 'odom'),
    ({'speed': 8.0, 'hfov_deg': 80.0}, 'odom', 'odom'),
    # Steps of the codes are not in metres, whatever else is.
    ({'camera_height': 1.6, 'path_from': 'codes'}, 'phase_traj', 'odom'),
    ({'camera_height': 1.6, 'frame_id': 'world'}, 'world', 'world'),
    ({'frame_id': 'world'}, 'world', None),
])
def test_what_is_in_metres_is_in_odom(values, path, odometry):
    parameters = Parameters(**values)
    estimator = TrajectoryEstimator(EstimatorSettings())
    message = deserialize_message(MESSAGES.of_all(PATH, estimator, parameters), Path)
    assert message.header.frame_id == path
    assert parameters.settings.metric == (odometry is not None)
    assert odometry in (None, parameters.odom_frame)
    assert parameters.notices == ()


@pytest.mark.parametrize(('values', 'said'), [
    ({'publish_tf': True}, 'publish_tf is set, but no metres are known'),
    ({'frame_id': 'odom'}, "frame_id is 'odom', but no metres are known"),
    ({'map_file': 'a.osm', 'publish_map_tf': True}, 'publish_map_tf is set, but no metres'),
])
def test_what_has_no_metres_and_looks_as_if_it_had_is_said(values, said):
    assert any(said in notice for notice in Parameters(**values).notices)
    assert Parameters(**values, camera_height=1.6).notices == ()


def test_what_has_no_effect_is_said():
    [notice] = Parameters(map_roads='all', map_datum='49,8').notices
    assert notice == 'no effect without map_file: map_roads, map_datum'
    [notice] = Parameters(lens_straightness=0.2, lens_offset=0.1).notices
    assert notice == 'no effect without focal_px or hfov_deg: lens_straightness, lens_offset'
    [notice] = Parameters(camera_height_deviation=0.1).notices
    assert notice.startswith('no effect without camera_height, unless /tf_static')
    assert Parameters(hfov_deg=90.0, lens_offset=0.1).notices == ()
    assert Parameters(camera_height=1.5, camera_height_deviation=0.1).notices == ()
    [notice] = Parameters(code_source='heading', threshold=12.0).notices
    assert notice.startswith('no effect with code_source heading: threshold')


def test_a_frame_is_not_its_own_parent():
    with pytest.raises(ParameterError, match="both 'odom'"):
        Parameters(camera_height=1.6, child_frame_id='odom')
