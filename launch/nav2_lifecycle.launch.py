# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
An example: the node under the lifecycle manager of nav2. docs/how-to/ros.md.

For example::

    ros2 launch phase_traj_ros nav2_lifecycle.launch.py image:=/camera/image_raw
"""

from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return the node, unconfigured, and the manager that configures and activates it."""
    launch_file = PathJoinSubstitution(
        [FindPackageShare('phase_traj_ros'), 'launch', 'phase_traj.launch.py'])
    return LaunchDescription([
        # First, so that nothing is started where nav2 is not installed.
        Node(
            package='nav2_lifecycle_manager', executable='lifecycle_manager',
            name='lifecycle_manager_phase_traj', output='screen',
            parameters=[{'node_names': ['phase_traj'], 'autostart': True}]),
        # The other arguments of phase_traj.launch.py are also those of this file.
        IncludeLaunchDescription(launch_file, launch_arguments={'lifecycle': 'true'}.items())])
