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
from launch_ros.actions import Node
from launch_ros.utilities.namespace_utils import make_namespace_absolute, prefix_namespace
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import values_for
from phase_traj_ros.parameters import NODE_NAME, Parameters, Transport

CONFIG = Path(__file__).resolve().parent.parent / 'config'

ARGUMENTS = {
    'image': 'Image topic of the forward camera.',
    'camera_info': 'Topic of its calibration, if it is not next to the image topic.',
    'speed': "Topic of the vehicle's speed, or a constant speed in m/s.",
    'params_file': 'ROS parameter file of the node, or the name of one in config/.',
    'output_dir': 'Folder for ~/save and record_shifts.',
    'namespace': 'Namespace of the node.',
    'name': 'Name of the node.',
    'use_sim_time': 'Use the time of /clock: true or false.',
    'reliable': 'Subscribe to the images as reliable with keep_all: true or false.',
    'respawn': 'Restart the node when it exits: true or false.',
    'log_level': 'debug, info, warn, error or fatal.',
    'rviz': 'Show image, path and pose in RViz: true or false.',
}
RESPAWN_DELAY_S = 2.0
SHOWN = ('debug_image', 'path', 'pose')


def generate_launch_description():
    """Return the arguments, and the function that makes the nodes from them."""
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value='', description=text)
          for name, text in ARGUMENTS.items()),
        OpaqueFunction(function=nodes)])


def nodes(context):
    """Return the nodes; raise RuntimeError for wrong arguments before a node starts."""
    configured = context.launch_configurations
    given = {name: configured[name] for name in ARGUMENTS if configured.get(name)}
    name = given.get('name', NODE_NAME)
    namespace = make_namespace_absolute(
        prefix_namespace(configured.get('ros_namespace'), given.get('namespace')) or '/')
    full_name = f'{namespace.rstrip("/")}/{name}'
    file = params_file(given['params_file']) if 'params_file' in given else None
    # In the order in which they reach the node: a later value replaces an earlier one.
    known = dict(each for each in configured.get('global_params', [])
                 if isinstance(each, tuple))
    known.update(values_for(file, full_name) if file else {})
    own = own_parameters(given)
    if is_true(given, 'reliable'):
        own.update(reliable(image_topic(configured, given, namespace, known)))
    node = Node(
        package='phase_traj_ros', executable='phase_traj_node', name=name,
        namespace=given.get('namespace', ''), output='screen',
        parameters=[*([str(file)] if file else []), *([own] if own else [])],
        # Before the remappings of a parent: the first matching one is applied.
        ros_arguments=[*remappings(given), *log_level(given, full_name)],
        respawn=is_true(given, 'respawn'), respawn_delay=RESPAWN_DELAY_S)
    frame = str(known.get('frame_id', Parameters().frame_id))
    return [*([rviz(given, full_name, frame)] if is_true(given, 'rviz') else []), node]


def params_file(given):
    """Return the file given by its path or by its name in config/."""
    for path in (Path(given), CONFIG / given):
        if path.is_file():
            return path.resolve()
    names = ', '.join(sorted(path.name for path in CONFIG.glob('*.yaml') if is_for_node(path)))
    raise RuntimeError(f'params_file {given!r} does not exist; config/ contains {names}')


def is_for_node(path):
    """Return whether a parameter file has parameters for the node."""
    try:
        return bool(values_for(path, f'/{NODE_NAME}'))
    except ParameterError:
        return False


def own_parameters(given):
    """Return the parameters that have their own launch argument."""
    own = {}
    if 'use_sim_time' in given:
        own['use_sim_time'] = is_true(given, 'use_sim_time')
    if 'output_dir' in given:
        own['output_dir'] = given['output_dir']
    if 'speed' in given:
        constant = constant_speed(given)
        own.update({'use_speed_topic': True} if constant is None else {'speed': constant})
    return own


def constant_speed(given):
    """Return the speed if it is a number, None if it is a topic."""
    try:
        return float(given['speed'])
    except ValueError:
        return None


def remappings(given):
    """Return the ROS arguments that remap the given topics."""
    topics = [each for each in ('image', 'camera_info') if each in given]
    if 'speed' in given and constant_speed(given) is None:
        topics.append('speed')
    return [part for each in topics for part in ('-r', f'{each}:={given[each]}')]


def log_level(given, full_name):
    """Return the ROS arguments that set the log level of the node."""
    if 'log_level' not in given:
        return []
    logger = full_name.strip('/').replace('/', '.')
    return ['--log-level', f'{logger}:={given["log_level"]}']


def image_topic(configured, given, namespace, known):
    """Return the full name of the image topic."""
    remapped = dict(reversed(configured.get('ros_remaps', [])))
    topic = given.get('image') or remapped.get('image', 'image')
    topic = topic if topic.startswith('/') else f'{namespace.rstrip("/")}/{topic}'
    compressed = str(known.get('image_transport')) == Transport.COMPRESSED.value
    return f'{topic}/compressed' if compressed else topic


def reliable(topic):
    """Return the parameters that make the subscription reliable with keep_all."""
    prefix = f'qos_overrides.{topic}.subscription'
    return {f'{prefix}.reliability': 'reliable', f'{prefix}.history': 'keep_all'}


def rviz(given, full_name, frame):
    """Return the node of RViz, which shows the topics of ``full_name`` in ``frame``."""
    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        raise RuntimeError(
            'rviz is true, but the package rviz2 is not installed: sudo apt install'
            ' ros-$ROS_DISTRO-rviz2, or leave rviz out') from None
    own = {'use_sim_time': is_true(given, 'use_sim_time')} if 'use_sim_time' in given else {}
    return Node(
        package='rviz2', executable='rviz2', name='rviz2',
        arguments=['-d', str(CONFIG / 'phase_traj.rviz'), '-f', frame],
        parameters=[own] if own else [],
        # The file names the topics of a node without namespace.
        remappings=[(f'/{NODE_NAME}/{topic}', f'{full_name}/{topic}') for topic in SHOWN])


def is_true(given, name):
    """Return whether the argument is given as true."""
    value = given.get(name, 'false').lower()
    if value not in ('true', 'false', '1', '0'):
        raise RuntimeError(f'{name} is {given[name]!r}: give true or false')
    return value in ('true', '1')
