# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
An example: one node for each of two cameras that look ahead. docs/how-to/two-cameras.md.

For example::

    ros2 launch phase_traj_ros two_cameras.launch.py output_dir:=/tmp/drive

Each node is in a namespace of its own. The group keeps the namespace, and the arguments of the
included launch file, from the other camera.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import PushRosNamespace
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare('phase_traj_ros')


def generate_launch_description():
    """Return the nodes /left/phase_traj and /right/phase_traj."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'cameras_file', default_value=PathJoinSubstitution([SHARE, 'config/two_cameras.yaml']),
            description='ROS parameter file for both nodes.'),
        DeclareLaunchArgument(
            'output_dir', default_value='', description='Folder for the files of both nodes.'),
        camera('left', '/left_camera/image_raw'),
        camera('right', '/right_camera/image_raw')])


def camera(namespace, image):
    """Return the node for one camera."""
    return GroupAction([
        PushRosNamespace(namespace),
        IncludeLaunchDescription(
            PathJoinSubstitution([SHARE, 'launch', 'phase_traj.launch.py']),
            launch_arguments={
                'image': image,
                'params_file': LaunchConfiguration('cameras_file'),
                'output_dir': LaunchConfiguration('output_dir'),
            }.items())])
