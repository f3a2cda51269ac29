# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Checks overrides of the quality of service before they take effect.

rclpy accepts parameters such as ``qos_overrides./image.subscription.reliability``. It reports a
wrong value with a traceback, and ignores a wrong name.
"""

from collections.abc import Mapping
from difflib import get_close_matches
from types import MappingProxyType

from phase_traj_ros.errors import ParameterError
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSPolicyKind

PREFIX = 'qos_overrides.'
_WORDS = {
    'history': ('keep_last', 'keep_all', 'system_default'),
    'reliability': ('reliable', 'best_effort', 'system_default', 'best_available'),
}
_DEEPEST = 1_000_000
# Other policies exist, and may be meant for another node in the same file.
_POLICIES = tuple(kind.lower() for kind in QoSPolicyKind.__members__ if kind != 'INVALID')


def initial_values(node: Node) -> Mapping[str, Parameter]:
    """Return the parameters with which ``node`` was started; rclpy has no public name for them."""
    return MappingProxyType(node._parameter_overrides)


def explained(node: Node, name: str) -> str:
    """Return a warning that the override ``name`` has no effect, with the valid names."""
    taken = sorted(f'{PREFIX}{each}' for each in node.get_parameters_by_prefix(PREFIX[:-1]))
    entities = sorted({each.rpartition('.')[0] for each in taken})
    entity, _, policy = name.rpartition('.')
    if entity in entities:
        return (f'{name!r} has no effect: {policy} is fixed for this topic; history, depth and'
                ' reliability can be overridden')
    near = get_close_matches(name, taken, n=1)
    hint = f'did you mean {near[0]!r}? ' if near else ''
    return (f'{name!r} has no effect: {hint}give'
            f' {PREFIX}TOPIC.ENTITY.POLICY, with history, depth or reliability for POLICY, and'
            ' one of these for TOPIC.ENTITY: '
            + ', '.join(entity.removeprefix(PREFIX) for entity in entities))


def check_override(name: str, value: object) -> None:
    """
    Check one override of the quality of service by its full name.

    Raises
    ------
    ParameterError
        The name is malformed, or the value is not allowed.

    """
    topic, _, rest = name.removeprefix(PREFIX).partition('.')
    entity, _, policy = rest.partition('.')
    # An entity may have an id at the end, after an underscore.
    if not topic.startswith('/') or entity.split('_')[0] not in ('publisher', 'subscription'):
        raise ParameterError(
            f"parameter {name!r}: give '{PREFIX}/TOPIC.subscription.POLICY' or"
            f" '{PREFIX}/TOPIC.publisher.POLICY', with the full name of the topic")
    if policy not in _POLICIES:
        near = get_close_matches(policy, _POLICIES, n=1)
        hint = f'did you mean {near[0]!r}?' if near else f'give one of {", ".join(_POLICIES)}'
        raise ParameterError(f'parameter {name!r}: there is no policy {policy!r}: {hint}')
    if policy == 'depth' and not (type(value) is int and 1 <= value <= _DEEPEST):
        raise ParameterError(
            f'parameter {name!r} is {value!r}: give an integer from 1 to {_DEEPEST}')
    if policy in _WORDS and not (isinstance(value, str) and value.lower() in _WORDS[policy]):
        raise ParameterError(
            f'parameter {name!r} is {value!r}: give one of {", ".join(_WORDS[policy])}')
