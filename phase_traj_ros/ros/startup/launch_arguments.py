# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The arguments of the launch file, checked before a process starts; it does not need launch."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
import posixpath
from types import MappingProxyType

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import find_params_file, parse_assignment, values_for
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.parameters import NODE_NAME, Parameters, specs
from phase_traj_ros.ros.spin import names_explained
from phase_traj_ros.ros.startup.overrides import check_override, PREFIX
from rclpy.expand_topic_name import expand_topic_name
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_topic_name import validate_topic_name

LOG_LEVELS = ('debug', 'info', 'warn', 'error', 'fatal')
_TRUTH = {'true': True, '1': True, 'false': False, '0': False}


ARGUMENTS = {
    'image': ('image', 'Image topic of the forward camera.'),
    'camera_info': ('', 'Topic of its calibration. Empty: the one next to the image topic.'),
    'image_transport': ('raw', 'raw, or compressed for the images on IMAGE/compressed.'),
    'speed': ('', "Topic of the vehicle's speed, or a constant speed in m/s. Empty: none."),
    'params_file': (
        '', 'ROS parameter file of the node, or the name of one in config/. Empty: none.'),
    'output_dir': ('', 'Folder in which drives are saved. Empty: no files are written.'),
    'map_file': ('', 'Road map on which the vehicle is located. Empty: it is not located.'),
    'namespace': ('', 'Namespace of the node.'),
    'name': (NODE_NAME, 'Name of the node.'),
    'lifecycle': ('false', 'Start unconfigured, for a manager: true or false.'),
    'autostart': ('false', 'With lifecycle, configure and activate at the start: true or false.'),
    'use_sim_time': ('false', 'Use the time of /clock: true or false.'),
    'reliable': ('false', 'Subscribe to the images as reliable with keep_all: true or false.'),
    'respawn': ('false', 'Restart the node when it exits: true or false.'),
    'log_level': ('info', f'One of {", ".join(LOG_LEVELS)}.'),
    'rviz': ('false', 'Show images, path, pose and odometry in RViz: true or false.'),
}
"""Default and description of each launch argument; given with its default, it is not given."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeStart:
    """How to start the node."""

    name: str
    namespace: str
    params_file: Path | None
    own: Mapping[str, object]
    """The parameters that have their own argument; they replace those of the file."""
    ros_arguments: list[str]
    """The ROS arguments for remappings and log level."""
    flags: Mapping[str, bool]
    """The arguments that are true or false."""
    frame: str
    """The frame of path and pose."""


def node_start(
    arguments: Mapping[str, str], *, namespace: str = '',
    remappings: Mapping[str, str] = MappingProxyType({}),
    params: Sequence['tuple[str, object] | str | Path'] = (),
) -> NodeStart:
    """
    Return how to start the node.

    Parameters
    ----------
    arguments
        The launch arguments.
    namespace, remappings
        What a parent launch file has set.
    params
        Its parameters and parameter files, in the order in which they reach the node.

    Raises
    ------
    ParameterError
        An argument, a parameter file or a parameter in it is not valid.

    """
    given = {name: value for name, (default, _) in ARGUMENTS.items()
             if (value := arguments.get(name, '')) not in ('', default)}
    flags = {name: _flag(name, given.get(name, default))
             for name, (default, _) in ARGUMENTS.items() if default == 'false'}
    name = given.get('name', NODE_NAME)
    namespace = posixpath.join('/', namespace, given.get('namespace', '')).rstrip('/') or '/'
    with names_explained():
        validate_node_name(name)
        validate_namespace(namespace)
    full_name = posixpath.join(namespace, name)
    own = _own(given, flags)
    file = find_params_file(given['params_file']).resolve() if 'params_file' in given else None
    values = {**_of_parent(params, full_name),
              **(values_for(file, full_name) if file else {}), **own}
    flags['use_sim_time'] = values.get('use_sim_time') is True
    frame = _checked(values).path_frame
    topics = ['image', 'camera_info', *(['speed'] if 'use_speed_topic' in own else [])]
    remapped = {each: given[each] for each in topics if each in given}
    for topic in remapped.values():
        _full_topic(topic, name, namespace)
    if flags['reliable']:
        topic = _full_topic({'image': 'image', **remappings, **remapped}['image'], name, namespace)
        compressed = values.get('image_transport') == 'compressed'
        prefix = f'{PREFIX}{topic}{"/compressed" if compressed else ""}.subscription'
        own |= {f'{prefix}.reliability': 'reliable', f'{prefix}.history': 'keep_all'}
    ros_arguments = [part for origin, topic in remapped.items()
                     for part in ('-r', f'{origin}:={topic}')]
    if 'log_level' in given:
        level = given['log_level']
        if level.lower() not in LOG_LEVELS:
            raise ParameterError(f'log_level is {level!r}: give one of {", ".join(LOG_LEVELS)}')
        logger = full_name.strip('/').replace('/', '.')
        ros_arguments += ['--log-level', f'{logger}:={level}']
    return NodeStart(
        name=name, namespace=namespace, params_file=file, own=own, ros_arguments=ros_arguments,
        flags=flags, frame=frame)


def _flag(name: str, value: str) -> bool:
    if value.lower() not in _TRUTH:
        raise ParameterError(f'{name} is {value!r}: give true or false')
    return _TRUTH[value.lower()]


def _own(given: Mapping[str, str], flags: Mapping[str, bool]) -> dict[str, object]:
    """Return the parameters that have their own argument."""
    own: dict[str, object] = {
        name: str(user_path(given[name])) for name in ('output_dir', 'map_file')
        if name in given}
    if 'image_transport' in given:
        own['image_transport'] = given['image_transport']
    if 'use_sim_time' in given:
        own['use_sim_time'] = flags['use_sim_time']
    if 'speed' in given:
        try:
            own['speed'] = float(given['speed'])
        except ValueError:
            own['use_speed_topic'] = True
    if flags['lifecycle']:
        own['autostart'] = flags['autostart']
    elif flags['autostart']:
        raise ParameterError(
            'autostart is true, but lifecycle is not: leave autostart out, since the node starts'
            ' active, or give lifecycle:=true as well')
    return own


def _of_parent(
    params: Sequence['tuple[str, object] | str | Path'], full_name: str,
) -> dict[str, object]:
    """Return the parameters that a parent launch file has set for the node."""
    known: dict[str, object] = {}
    for each in params:
        if isinstance(each, tuple):
            # launch_ros passes it in this form.
            known.update([parse_assignment(f'{each[0]}:={each[1]}')])
        elif not Path(each).is_file():
            # launch_ros would end with an empty message.
            raise ParameterError(
                f'SetParametersFromFile has {str(each)!r}, which is not a file: give its path')
        else:
            # It may be for other nodes only.
            with suppress(ParameterError):
                known.update(values_for(Path(each), full_name))
    return known


def _checked(values: Mapping[str, object]) -> Parameters:
    """Return the parameters that the node will have, as far as they are known here."""
    for name, value in values.items():
        if name.startswith(PREFIX):
            check_override(name, value)
    kinds = {spec.name: spec.type for spec in specs()}
    return Parameters().with_values({
        name: value for name, value in values.items()
        # ROS reads some texts as numbers that YAML does not: the node checks them.
        if name in kinds and not (kinds[name] == 'double' and isinstance(value, str))})


def _full_topic(topic: str, name: str, namespace: str) -> str:
    with names_explained():
        validate_topic_name(topic)
        full = expand_topic_name(topic, name, namespace)
        validate_full_topic_name(full)
    return str(full)
