# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of a node while it runs."""

from collections.abc import Callable, Sequence
from typing import Any

from phase_traj_ros.parameter_spec import Spec
from phase_traj_ros.parameters import Parameters, specs, unknown_parameter
from phase_traj_ros.ros.startup.overrides import check_override, explained, initial_values, PREFIX
from phase_traj_ros.ros.startup.param_files import param_files_for
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter


class LiveParameters:
    """Declares the parameters, rejects invalid values and passes on changes."""

    def __init__(
        self, node: Node, *, check: Callable[[Parameters], None],
        on_change: Callable[[Parameters], None],
    ) -> None:
        """
        Declare the parameters on ``node``, which must not have any topic yet.

        Before a change, ``check`` is called and may raise ValueError. After it, ``on_change``
        receives the new values.

        Raises
        ------
        ParameterError
            An initial value is not allowed.

        """
        self._node = node
        self._check_further = check
        self._on_change = on_change
        for name, parameter in initial_values(node).items():
            if name.startswith(PREFIX):
                check_override(name, parameter.value)
        self._files, self._warnings = param_files_for(node)
        self.values = Parameters().with_values(
            {spec.name: declare(node, spec) for spec in specs()})
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def tell(self) -> None:
        """Log the values in use and the ones without effect; call it when the topics exist."""
        log = self._node.get_logger()
        for warning in self._warnings:
            log.warning(f'{warning} (or ignore this, if the file is for other nodes only)')
        for notice in self.values.notices:
            log.warning(notice)
        own = [f'{spec.name} {self.values.value(spec)!r}' for spec in self.values.changed]
        if self._node.get_parameter('use_sim_time').value:
            own.append('use_sim_time True')
        for name, parameter in sorted(initial_values(self._node).items()):
            is_policy = name.startswith(PREFIX)
            if not self._node.has_parameter(name):
                log.warning(
                    explained(self._node, name) if is_policy else
                    f'a given value has no effect, as {unknown_parameter(name)}')
            elif is_policy:
                own.append(f'{name} {parameter.value!r}')
        files = ', '.join(map(str, self._files)) or 'no parameter file'
        log.info(f'parameters, with {files}: ' + (', '.join(own) or 'all at their defaults'))

    def _with(self, updates: Sequence[Parameter]) -> Parameters:
        """Return the values with updates; parameters of rclpy and ``autostart`` are ignored."""
        known = {spec.name for spec in specs()}
        return self.values.with_values(
            {update.name: update.value for update in updates if update.name in known})

    def _check(self, updates: Sequence[Parameter]) -> SetParametersResult:
        try:
            self._check_further(self._with(updates))
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, updates: Sequence[Parameter]) -> None:
        values = self._with(updates)
        if values != self.values:
            self.values = values
            self._on_change(values)


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


def _descriptor(spec: Spec) -> ParameterDescriptor:
    descriptor: Any = ParameterDescriptor(
        description=f'{spec.description} [{spec.unit}]' if spec.unit else spec.description,
        additional_constraints=spec.allowed,
        read_only=spec.read_only,
    )
    if spec.minimum is not None and spec.maximum is not None:
        if spec.type == 'double':
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=spec.minimum, to_value=spec.maximum)]
        else:
            descriptor.integer_range = [IntegerRange(
                from_value=int(spec.minimum), to_value=int(spec.maximum), step=1)]
    return descriptor
