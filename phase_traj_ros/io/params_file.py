# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the parameters of the node from a ROS parameter file, without ROS."""

from collections.abc import Callable, Iterator, Mapping
import os
from pathlib import Path
import re
from typing import ClassVar

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.parameters import NODE_NAME, Parameters
import yaml

_VALUES = 'ros__parameters'
_MISSPELT = ('ros_parameters', 'ros__parameter', 'ros_parameter')
# PyYAML raises a plain ValueError for e.g. a 13th month or a number with thousands of digits.
_NO_YAML = (yaml.YAMLError, ValueError, RecursionError)
# Parameters of the node itself, which a replay ignores.
_OF_EVERY_NODE = ('use_sim_time', 'qos_overrides', 'start_type_description_service', 'autostart')


def config_folder() -> Path:
    """Return the folder ``config`` of the package: installed, or of a checkout."""
    package = Path(__file__).resolve().parents[1]
    # PREFIX/lib/pythonX/site-packages/phase_traj_ros
    for prefix in package.parents[3:4]:
        installed = prefix / 'share' / package.name / 'config'
        if installed.is_dir():
            return installed
    return package.parent / 'config'


def find_params_file(given: str | Path) -> Path:
    """
    Return the file of that path, or else the file of that name in the package's ``config/``.

    A leading ``~`` is the home folder.

    Raises
    ------
    ParameterError
        There is no such file.

    """
    config = config_folder()
    for path in (user_path(str(given)), config / given):
        # Those of Path raise an error for a path that cannot be examined, before Python 3.14.
        if os.path.exists(path) and not os.path.isdir(path):
            return path
    names = ', '.join(sorted(path.name for path in config.glob('*.yaml') if _is_for_node(path)))
    raise ParameterError(
        f"there is no parameter file {str(given)!r}: give a path, or one of the package's own:"
        f' {names}')


def read_parameters(path: Path) -> Parameters:
    """
    Return the parameters that ``path`` gives to the node; others keep their defaults.

    Sections for any node (``/**``) and for the node's name in any namespace apply; those for
    other nodes do not. If several sections give one parameter, the last one applies.

    Raises
    ------
    ParameterError
        The file cannot be read, is not a ROS parameter file, has no section for this node, or
        gives a parameter that is unknown or not allowed.

    """
    values = _values(path, NODE_NAME, lambda pattern: pattern.rpartition('/')[2] in (
        NODE_NAME, '**', '*'))
    own = {name: value for name, value in values.items()
           if name.split('.')[0] not in _OF_EVERY_NODE}
    try:
        return Parameters().with_values(own)
    except ParameterError as error:
        raise ParameterError(f'{path}: {error}') from None


def check_syntax(path: Path) -> None:
    """
    Check that ``path`` can be read as a ROS parameter file, whatever node it is for.

    Raises
    ------
    ParameterError
        The file cannot be read, or is not a ROS parameter file.

    """
    _sections(path)


def values_for(path: Path, full_name: str) -> dict[str, object]:
    """
    Return what ``path`` gives to the node of that name, such as ``/front/phase_traj``.

    In the file, ``*`` stands for one part of a name, ``**`` for any number of them, as in ROS.
    Names of parameters are joined by dots; values are not converted.

    Raises
    ------
    ParameterError
        The file cannot be read, is not a ROS parameter file, or has nothing for this node.

    """
    return _values(path, full_name, lambda pattern: _names_node(pattern, full_name))


def _values(path: Path, node: str, is_meant: Callable[[str], bool]) -> dict[str, object]:
    """Return the values of the sections that are meant; the last one applies."""
    sections = _sections(path)
    own = [values for pattern, values in sections if is_meant(pattern)]
    if not own:
        others = ', '.join(pattern for pattern, _ in sections) or 'no node'
        raise ParameterError(
            f"{path} has parameters for {others}, not for {node}: put them under '/**:' or"
            f" '{node}:', in '{_VALUES}:'")
    return {name: value for values in own for name, value in _flatten(values)}


def _is_for_node(path: Path) -> bool:
    try:
        return bool(values_for(path, f'/{NODE_NAME}'))
    except ParameterError:
        return False


def _names_node(pattern: str, full_name: str) -> bool:
    parts = [
        {'**': r'(/[^/]+)*', '*': r'/[^/]+'}.get(part, f'/{re.escape(part)}')
        for part in pattern.split('/') if part]
    return re.fullmatch(''.join(parts), full_name) is not None


def parse_assignment(text: str) -> tuple[str, object]:
    """
    Return name and value of an assignment in the form of ROS, ``name:=value``.

    Raises
    ------
    ParameterError
        The text is not such an assignment.

    """
    name, assigned, value = text.partition(':=')
    try:
        if assigned and name:
            return name, yaml.load(value, Loader=_Loader) if value else ''
    except _NO_YAML:
        pass
    raise ParameterError(f'{text!r} does not assign a parameter: write NAME:=VALUE')


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """
    Reads values as ROS does (rcl_yaml_param_parser): no dates, base 60, merges or aliases.

    Nested aliases describe contents without bounds.
    """

    yaml_implicit_resolvers: ClassVar[dict[str, object]] = {}
    bool_values: ClassVar = {**yaml.SafeLoader.bool_values, 'y': True, 'n': False}

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.composer.ComposerError(
                None, None, 'an alias (*name): write its content in full', mark)
        return super().compose_node(parent, index)


# The first pattern that fits applies.
for _tag, _pattern, _first in (
        ('null', r'(~|null|Null|NULL|)$', ['~', 'n', 'N', '']),
        ('bool', r'([yYnN]|yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off'
                 r'|OFF)$', 'yYnNtTfFoO'),
        ('int', r'[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)$', '-+0123456789'),
        ('float', r'([-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN))$',
         '-+.0123456789')):
    _Loader.add_implicit_resolver(
        f'tag:yaml.org,2002:{_tag}', re.compile(_pattern, re.ASCII), list(_first))


def _sections(path: Path) -> list[tuple[str, Mapping[object, object]]]:
    """Return each node's name and values, in the order of the file."""
    try:
        # YAML reads it in pieces, so a large binary file is refused at its first bytes.
        with path.open('rb') as file:
            content = yaml.load(file, Loader=_Loader)
    except OSError as error:
        raise ParameterError(f'cannot read the parameter file {path}: {error.strerror}') from None
    except _NO_YAML as error:
        reason = ' '.join(str(error).split()).replace(f'"{path}", ', '')
        raise ParameterError(f'{path} is not YAML: {reason}') from None
    return list(_find_sections(path, '', content))


def _find_sections(
    path: Path, prefix: str, content: object,
) -> Iterator[tuple[str, Mapping[object, object]]]:
    # Namespaces may be written as one key (/ns/node) or as nested ones (/ns: node:).
    if not isinstance(content, dict):
        raise ParameterError(f"{path} is not a ROS parameter file: write '/**:' over '{_VALUES}:'")
    for key, value in content.items():
        if key in _MISSPELT:
            raise ParameterError(
                f"{path} has {key!r} in {prefix or 'no node'!r}: write '{_VALUES}', with two"
                ' underscores')
        if key != _VALUES:
            yield from _find_sections(path, f'{prefix}/{str(key).strip("/")}', value)
        elif isinstance(value, dict):
            yield prefix, value
        else:
            raise ParameterError(f"{path}: '{_VALUES}' of {prefix!r} holds no parameters")


def _flatten(values: Mapping[object, object], prefix: str = '') -> Iterator[tuple[str, object]]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flatten(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}', value
