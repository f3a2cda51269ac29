# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Start the node for one camera.

For example::

    ros2 launch phase_traj_ros phase_traj.launch.py image:=/front_camera/image_raw
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return the node and its arguments."""
    arguments = [
        DeclareLaunchArgument(
            'image', default_value='image', description='Image topic of the forward camera.'),
        DeclareLaunchArgument(
            'params_file',
            default_value=PathJoinSubstitution(
                [FindPackageShare('phase_traj_ros'), 'config', 'paper.yaml']),
            description='ROS parameter file of the node.'),
        DeclareLaunchArgument(
            'namespace', default_value='', description='Namespace of the node.'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', description='Take the time from /clock.'),
    ]
    node = Node(
        package='phase_traj_ros',
        executable='phase_traj_node',
        name='phase_traj',
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            LaunchConfiguration('params_file'),
            {'use_sim_time': ParameterValue(
                LaunchConfiguration('use_sim_time'), value_type=bool)},
        ],
        remappings=[('image', LaunchConfiguration('image'))],
        output='screen',
    )
    return LaunchDescription([*arguments, node])
