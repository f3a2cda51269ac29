# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
An example: the node under the lifecycle manager of nav2. docs/how-to/ros.md.

For example::

    ros2 launch phase_traj_ros nav2_lifecycle.launch.py image:=/camera/image_raw
"""

from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription, OpaqueFunction
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from phase_traj_ros.ros.startup.launch_arguments import node_start

UNCONFIGURED = {'lifecycle': 'true', 'autostart': 'false'}


def generate_launch_description():
    """Return the manager, and the node that it configures and activates."""
    launch_file = PathJoinSubstitution(
        [FindPackageShare('phase_traj_ros'), 'launch', 'phase_traj.launch.py'])
    return LaunchDescription([
        # First, so that nothing is started where nav2 is not installed.
        OpaqueFunction(function=manager),
        # Its other arguments are also those of this file.
        IncludeLaunchDescription(launch_file, launch_arguments=UNCONFIGURED.items())])


def manager(context):
    """Return the manager, in the namespace of the node."""
    given = context.launch_configurations
    start = node_start(
        {**given, **UNCONFIGURED}, namespace=given.get('ros_namespace') or '',
        params=given.get('global_params', []))
    return [Node(
        package='nav2_lifecycle_manager', executable='lifecycle_manager',
        name='lifecycle_manager_phase_traj', namespace=start.namespace, output='screen',
        parameters=[{
            'node_names': [start.name], 'autostart': True,
            'use_sim_time': start.flags['use_sim_time']}])]
