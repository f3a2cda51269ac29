# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Declares the parameters on a node."""

from collections.abc import Iterable
from typing import Any

from phase_traj_ros.parameter_spec import Spec
from phase_traj_ros.parameters import Parameters, specs
from phase_traj_ros.ros.startup.overrides import initial_values
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter


def declare_parameters(node: Node) -> Parameters:
    """
    Declare all parameters on ``node`` and return their initial values.

    Raises
    ------
    ParameterError
        An initial value is of the wrong type or out of its range.

    """
    return Parameters().with_values({spec.name: declare(node, spec) for spec in specs()})


def declare(node: Node, spec: Spec) -> object:
    """
    Declare one parameter on ``node`` and return its initial value.

    Raises
    ------
    ParameterError
        The initial value is of the wrong type or out of its range.

    """
    override = initial_values(node).get(spec.name)
    if override is not None:
        # The message of rclpy names the type by a number and does not say what to write instead.
        spec.check(override.value)
    return node.declare_parameter(spec.name, spec.default, _descriptor(spec)).value


def changed(parameters: Parameters, updates: Iterable[Parameter]) -> Parameters:
    """
    Return ``parameters`` with the values of ``updates``; parameters of others are ignored.

    Raises
    ------
    ParameterError
        A value is not allowed.

    """
    known = {spec.name for spec in specs()}
    return parameters.with_values(
        {update.name: update.value for update in updates if update.name in known})


def _descriptor(spec: Spec) -> ParameterDescriptor:
    descriptor: Any = ParameterDescriptor(
        description=f'{spec.description} [{spec.unit}]' if spec.unit else spec.description,
        additional_constraints=spec.allowed,
        read_only=spec.read_only,
    )
    if spec.minimum is not None and spec.maximum is not None and not spec.is_open:
        if spec.type == 'double':
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=spec.minimum, to_value=spec.maximum)]
        else:
            descriptor.integer_range = [IntegerRange(
                from_value=int(spec.minimum), to_value=int(spec.maximum), step=1)]
    return descriptor
