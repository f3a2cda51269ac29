# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Start the node for one camera.

For example::

    ros2 launch phase_traj_ros phase_traj.launch.py image:=/front_camera/image_raw
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
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
        DeclareLaunchArgument(
            'rviz', default_value='false', description='Show image, path and pose in RViz.'),
    ]
    sim_time = {'use_sim_time': ParameterValue(
        LaunchConfiguration('use_sim_time'), value_type=bool)}
    node = Node(
        package='phase_traj_ros',
        executable='phase_traj_node',
        name='phase_traj',
        namespace=LaunchConfiguration('namespace'),
        parameters=[LaunchConfiguration('params_file'), sim_time],
        remappings=[('image', LaunchConfiguration('image'))],
        output='screen',
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        name='rviz2',
        arguments=['-d', PathJoinSubstitution(
            [FindPackageShare('phase_traj_ros'), 'config', 'phase_traj.rviz'])],
        parameters=[sim_time],
        # The file names the topics of a node without namespace.
        remappings=[
            (f'/phase_traj/{topic}', [LaunchConfiguration('namespace'), f'/phase_traj/{topic}'])
            for topic in ('debug_image', 'path', 'pose')],
        condition=IfCondition(LaunchConfiguration('rviz')),
    )
    return LaunchDescription([*arguments, node, rviz])
