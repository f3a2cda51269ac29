# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Requirements of test files that are not requirements of the package.

A file with a missing requirement is not collected. No file may skip itself on import:
launch_testing, whose plugin is part of every ROS installation, imports the files during
collection, and such a skip would end the whole run.
"""

from importlib.util import find_spec

NEEDS = {
    'io/messages/test_ekf_config.py': ('rosbags',),
    'io/results/test_bag_sink.py': ('rosbags', 'mcap', 'mcap_ros2'),
    'io/sources/test_pyav_video.py': ('av',),
    'io/results/test_distance_results.py': ('matplotlib', 'rosbags'),
    'ros/location/test_location_messages.py': ('rclpy', 'visualization_msgs'),
    'ros/location/test_location_node.py': ('rclpy', 'visualization_msgs'),
    'ros/nodes/test_bond.py': ('rclpy',),
    'ros/outputs/test_outputs_agree.py': ('rclpy', 'rosbags'),
    'ros/startup/test_launch_arguments.py': ('rclpy',),
    'ros/test_same_stream.py': ('rclpy',),
    'synthetic/drive/test_synthetic_bag.py': ('rosbags',),
    'tasks/batch/test_batch.py': ('matplotlib',),
    'tasks/evaluation/test_evo.py': ('evo', 'rosbags'),
}
"""Modules by the file that imports them, relative to the folder of all tests."""


def lacking():
    """Return the files that cannot be imported here."""
    return [
        file for file, modules in NEEDS.items()
        if not all(find_spec(module) for module in modules)]
