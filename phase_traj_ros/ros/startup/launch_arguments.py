# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The arguments of the launch file, checked before a process starts; it does not need launch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import find_params_file, parse_assignment, values_for
from phase_traj_ros.parameters import NODE_NAME, Parameters, specs, Transport
from phase_traj_ros.ros.spin import names_explained
from phase_traj_ros.ros.startup.overrides import check_override, PREFIX
from rclpy.expand_topic_name import expand_topic_name
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_topic_name import validate_topic_name

LOG_LEVELS: Final = ('debug', 'info', 'warn', 'error', 'fatal')
_TRUTH = MappingProxyType({'true': True, '1': True, 'false': False, '0': False})


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument:
    """A launch argument; given with its default, it counts as not given."""

    default: str = ''
    description: str


ARGUMENTS: Final[Mapping[str, Argument]] = MappingProxyType({
    'image': Argument(default='image', description='Image topic of the forward camera.'),
    'camera_info': Argument(
        description='Topic of its calibration. Empty: the one next to the image topic.'),
    'image_transport': Argument(
        default=Transport.RAW.value,
        description='raw, or compressed for the images on IMAGE/compressed.'),
    'speed': Argument(
        description="Topic of the vehicle's speed, or a constant speed in m/s. Empty: none."),
    'params_file': Argument(
        description='ROS parameter file of the node, or the name of one in config/. Empty: none.'),
    'output_dir': Argument(
        description='Folder in which drives are saved. Empty: no files are written.'),
    'map_file': Argument(
        description='Road map on which the vehicle is located. Empty: it is not located.'),
    'namespace': Argument(description='Namespace of the node.'),
    'name': Argument(default=NODE_NAME, description='Name of the node.'),
    'lifecycle': Argument(
        default='false', description='Start unconfigured, for a manager: true or false.'),
    'autostart': Argument(
        default='false',
        description='With lifecycle, configure and activate at the start: true or false.'),
    'use_sim_time': Argument(
        default='false', description='Use the time of /clock: true or false.'),
    'reliable': Argument(
        default='false',
        description='Subscribe to the images as reliable with keep_all: true or false.'),
    'respawn': Argument(
        default='false', description='Restart the node when it exits: true or false.'),
    'log_level': Argument(default='info', description=f'One of {", ".join(LOG_LEVELS)}.'),
    'rviz': Argument(
        default='false',
        description='Show images, path, pose and odometry in RViz: true or false.'),
})


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What a parent launch file has set: for the node, unless an argument says otherwise."""

    namespace: str = ''
    remappings: Mapping[str, str] = field(default_factory=dict)
    params: tuple['tuple[str, object] | Path', ...] = ()
    """Single parameters and parameter files, in the order in which they reach the node."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeStart:
    """How to start the node."""

    name: str
    namespace: str
    params_file: Path | None
    own: Mapping[str, object]
    """The parameters that have their own argument; they replace those of the file."""
    remappings: Mapping[str, str]
    log_level: str
    lifecycle: bool
    respawn: bool
    rviz: bool
    use_sim_time: bool
    frame: str
    """The frame of path and pose."""

    @property
    def full_name(self) -> str:
        """Return the name with the namespace."""
        return f'{self.namespace.rstrip("/")}/{self.name}'

    @property
    def ros_arguments(self) -> list[str]:
        """Return the ROS arguments for remappings and log level."""
        arguments = [part for origin, topic in self.remappings.items()
                     for part in ('-r', f'{origin}:={topic}')]
        if self.log_level:
            logger = self.full_name.strip('/').replace('/', '.')
            arguments += ['--log-level', f'{logger}:={self.log_level}']
        return arguments


def node_start(arguments: Mapping[str, str], around: Surroundings) -> NodeStart:
    """
    Return how to start the node with these launch arguments.

    Raises
    ------
    ParameterError
        An argument, the parameter file or a parameter in it is not valid.

    """
    given = {name: value for name, argument in ARGUMENTS.items()
             if (value := arguments.get(name, '')) not in ('', argument.default)}
    name = given.get('name', NODE_NAME)
    namespace = _joined(around.namespace, given.get('namespace', ''))
    with names_explained():
        validate_node_name(name)
        validate_namespace(namespace)
    file = find_params_file(given['params_file']).resolve() if 'params_file' in given else None
    full_name = f'{namespace.rstrip("/")}/{name}'
    known = _parameters(around, file, full_name)
    own = _own(given)
    topics = ['image', 'camera_info', *(['speed'] if own.get('use_speed_topic') else [])]
    remappings = {each: given[each] for each in topics if each in given}
    for topic in remappings.values():
        _full_topic(topic, name, namespace)
    frame = _checked({**known, **own}).path_frame
    if _is_true(given, 'reliable'):
        topic = given.get('image') or around.remappings.get('image', 'image')
        topic = _full_topic(topic, name, namespace)
        compressed = {**known, **own}.get('image_transport') == Transport.COMPRESSED.value
        prefix = f'qos_overrides.{topic}{"/compressed" if compressed else ""}.subscription'
        own |= {f'{prefix}.reliability': 'reliable', f'{prefix}.history': 'keep_all'}
    lifecycle, autostart = _is_true(given, 'lifecycle'), _is_true(given, 'autostart')
    if autostart and not lifecycle:
        raise ParameterError(
            'autostart is true, but lifecycle is not: leave autostart out, since the node starts'
            ' active, or give lifecycle:=true as well')
    if lifecycle:
        own['autostart'] = autostart
    return NodeStart(
        name=name, namespace=namespace, params_file=file, own=own, remappings=remappings,
        log_level=_log_level(given), lifecycle=lifecycle, respawn=_is_true(given, 'respawn'),
        rviz=_is_true(given, 'rviz'), use_sim_time=_is_true(given, 'use_sim_time'), frame=frame)


def _joined(base: str, namespace: str) -> str:
    """Return the absolute namespace, as launch_ros makes it of the one of a parent."""
    if not namespace.startswith('/'):
        namespace = f'{base.rstrip("/")}/{namespace}'
    namespace = namespace if namespace.startswith('/') else f'/{namespace}'
    return namespace.rstrip('/') or '/'


def _parameters(around: Surroundings, file: Path | None, full_name: str) -> dict[str, object]:
    """Return the parameters that reach the node without an argument of their own."""
    known: dict[str, object] = {}
    for each in around.params:
        if isinstance(each, tuple):
            # launch_ros passes it in this form.
            known.update([parse_assignment(f'{each[0]}:={each[1]}')])
        else:
            try:
                known.update(values_for(each, full_name))
            except ParameterError:
                continue  # The file of a parent may be for other nodes only.
    if file is not None:
        known.update(values_for(file, full_name))
    return known


def _own(given: Mapping[str, str]) -> dict[str, object]:
    """Return the parameters that have their own argument."""
    own: dict[str, object] = {}
    if 'image_transport' in given:
        own['image_transport'] = given['image_transport']
    if 'output_dir' in given:
        own['output_dir'] = str(Path(given['output_dir']).expanduser())
    if 'map_file' in given:
        own['map_file'] = str(Path(given['map_file']).expanduser())
    if 'use_sim_time' in given:
        own['use_sim_time'] = _is_true(given, 'use_sim_time')
    if 'speed' in given:
        try:
            own['speed'] = float(given['speed'])
        except ValueError:
            own['use_speed_topic'] = True
    return own


def _checked(values: Mapping[str, object]) -> Parameters:
    """Return the parameters that the node will have, as far as they are known here."""
    for name, value in values.items():
        if name.startswith(PREFIX):
            check_override(name, value)
    kinds = {spec.name: spec.type for spec in specs()}
    return Parameters().with_values({
        name: value for name, value in values.items()
        # ROS reads 1e1 as a number, PyYAML as text: the node checks it.
        if name in kinds and not (kinds[name] == 'double' and isinstance(value, str))})


def _full_topic(topic: str, name: str, namespace: str) -> str:
    with names_explained():
        validate_topic_name(topic)
        full = expand_topic_name(topic, name, namespace)
        validate_full_topic_name(full)
    return str(full)


def _is_true(given: Mapping[str, str], name: str) -> bool:
    value = given.get(name, 'false')
    if value.lower() not in _TRUTH:
        raise ParameterError(f'{name} is {value!r}: give true or false')
    return _TRUTH[value.lower()]


def _log_level(given: Mapping[str, str]) -> str:
    level = given.get('log_level', '')
    if level and level.lower() not in LOG_LEVELS:
        raise ParameterError(f'log_level is {level!r}: give one of {", ".join(LOG_LEVELS)}')
    return level
