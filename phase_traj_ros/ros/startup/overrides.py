# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Overrides of the quality of service, checked before they take effect.

rclpy takes parameters such as ``qos_overrides./image.subscription.reliability``. It answers a
value that cannot be with a traceback, and a name that means nothing with silence.
"""

from difflib import get_close_matches
from types import MappingProxyType
from typing import Final

from phase_traj_ros.errors import ParameterError
from rclpy.node import Node
from rclpy.qos import QoSPolicyKind

PREFIX: Final = 'qos_overrides.'
_ENTITIES = ('publisher', 'subscription')
_WORDS = MappingProxyType({
    'history': ('keep_last', 'keep_all', 'system_default'),
    'reliability': ('reliable', 'best_effort', 'system_default', 'best_available'),
})
_DEEPEST = 1_000_000
# Others exist, too, and may be meant for another node in the same file.
_POLICIES = tuple(kind.lower() for kind in QoSPolicyKind.__members__ if kind != 'INVALID')


def check_overrides(node: Node) -> None:
    """
    Accept the overrides that ``node`` was started with; to be called before it has endpoints.

    Raises
    ------
    ParameterError
        One is not of the form that ROS has for them, or its value is not allowed.

    """
    for name, parameter in node._parameter_overrides.items():
        if name.startswith(PREFIX):
            _check(name, parameter.value)


def unused_overrides(node: Node) -> list[str]:
    """Return the overrides that nothing on ``node`` takes; to be called when it has endpoints."""
    return sorted(
        name for name in node._parameter_overrides
        if name.startswith(PREFIX) and not node.has_parameter(name))


def explained(node: Node, name: str) -> str:
    """Return in a line that the override ``name`` has no effect, and which names would have."""
    taken = sorted(each for each in node._parameters if each.startswith(PREFIX))
    entities = sorted({each.rpartition('.')[0] for each in taken})
    near = get_close_matches(name, taken, n=1)
    hint = f'did you mean {near[0]!r}? ' if near else ''
    return (f'{name!r} has no effect: {hint}what has is'
            f' {PREFIX}TOPIC.ENTITY.POLICY, with history, depth or reliability for POLICY, of '
            + ', '.join(entity.removeprefix(PREFIX) for entity in entities))


def _check(name: str, value: object) -> None:
    topic, _, rest = name.removeprefix(PREFIX).partition('.')
    entity, _, policy = rest.partition('.')
    # An entity may have an id at the end, after an underscore.
    if not topic.startswith('/') or entity.split('_')[0] not in _ENTITIES:
        raise ParameterError(
            f"parameter {name!r}: it takes the form '{PREFIX}/TOPIC.subscription.POLICY', or"
            ' publisher, with the full name of the topic')
    if policy not in _POLICIES:
        near = get_close_matches(policy, _POLICIES, n=1)
        hint = f'did you mean {near[0]!r}?' if near else f'known are {", ".join(_POLICIES)}'
        raise ParameterError(f'parameter {name!r}: there is no policy {policy!r}: {hint}')
    if policy == 'depth' and not (type(value) is int and 1 <= value <= _DEEPEST):
        raise ParameterError(
            f'parameter {name!r} is {value!r}: it takes an integer from 1 to {_DEEPEST}')
    if policy in _WORDS and not (isinstance(value, str) and value.lower() in _WORDS[policy]):
        raise ParameterError(
            f'parameter {name!r} is {value!r}: it takes one of {", ".join(_WORDS[policy])}')
