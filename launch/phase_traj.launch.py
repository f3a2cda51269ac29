# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Start the node for one camera.

For example::

    ros2 launch phase_traj_ros phase_traj.launch.py image:=/front_camera/image_raw

Only the given arguments are passed to the node, so that a launch file that includes this one can
set all other parameters. Wrong arguments are reported before a process starts.
"""

from pathlib import Path

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import LifecycleNode, Node
from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.startup.launch_arguments import ARGUMENTS, node_start

CONFIG = Path(__file__).resolve().parent.parent / 'config'
RESPAWN_DELAY_S = 2.0
SHOWN = ('debug_image', 'path', 'pose', 'odom')


def generate_launch_description():
    """Return the arguments, and the function that makes the nodes from them."""
    return LaunchDescription([
        *(DeclareLaunchArgument(
            name, default_value=default, description=description)
          for name, (default, description) in ARGUMENTS.items()),
        OpaqueFunction(function=nodes)])


def nodes(context):
    """Return the nodes; raise ParameterError for wrong arguments before a node starts."""
    configured = context.launch_configurations
    start = node_start(
        configured,
        namespace=configured.get('ros_namespace') or '',
        # The first matching remapping is applied.
        remappings=dict(reversed(configured.get('ros_remaps', []))),
        params=configured.get('global_params', []))
    kind = LifecycleNode if start.flags['lifecycle'] else Node
    node = kind(
        package='phase_traj_ros', executable='phase_traj_node', name=start.name,
        namespace=start.namespace, output='screen',
        parameters=[*([str(start.params_file)] if start.params_file else []),
                    *([dict(start.own)] if start.own else [])],
        # Before the remappings of a parent: the first matching one is applied.
        ros_arguments=start.ros_arguments,
        respawn=start.flags['respawn'], respawn_delay=RESPAWN_DELAY_S)
    return [*([rviz(start)] if start.flags['rviz'] else []), node]


def rviz(start):
    """Return the node of RViz, which shows the topics of the node in its frame."""
    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        raise RuntimeError(
            'rviz is true, but the package rviz2 is not installed: sudo apt install'
            ' ros-$ROS_DISTRO-rviz2, or leave rviz out') from None
    prefix = f'{start.namespace.rstrip("/")}/{start.name}'
    return Node(
        package='rviz2', executable='rviz2', name='rviz2',
        arguments=['-d', str(CONFIG / 'phase_traj.rviz'), '-f', start.frame],
        parameters=[{'use_sim_time': True}] if start.flags['use_sim_time'] else [],
        # The file names the topics of a node without namespace.
        remappings=[(f'/{NODE_NAME}/{topic}', f'{prefix}/{topic}') for topic in SHOWN])
