# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Declarations of parameters: type, default, range or choices, unit, description."""

from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType
from typing import Any, TypeAlias

from phase_traj_ros.errors import ParameterError

Value: TypeAlias = 'bool | int | float | str'

_ROS_TYPES = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}

_CONSTANT = 'it is a constant now; leave it out'
_MASKED = 'leave the area out with mask_file'
# Parameters of earlier versions, and what to do instead.
REMOVED = MappingProxyType({
    'estimate_fov': 'code_source auto learns an unknown camera; leave it out',
    'threshold_deg_s': 'give threshold in px/frame, or leave both out (code_source auto)',
    'transform': 'the fastest library that is installed is used; leave it out',
    'speed_type': 'the type is that of the topic; leave it out',
    'record_shifts': 'record the topics with ros2 bag record; leave it out',
    'still_frames': 'give still_time in s: 0.5 instead of 5 frames at 10 Hz',
    'step_length': 'a step or a camera height is 1 m in the published path; leave it out',
    **dict.fromkeys(('rows_from', 'rows_to', 'columns_from', 'columns_to'), _MASKED),
    **dict.fromkeys(
        ('window', 'still_motion', 'chain_code_runs', 'max_runs', 'path_rate', 'max_path_poses',
         'max_pixels', 'threads'), _CONSTANT),
    **{name: f"its name is shift.{name} now, as it belongs to the paper's rule" for name in (
        'decimation', 'nominal_period', 'min_significance', 'look_past_zero', 'confirm_frames',
        'release_frames')},
})


class Group(Enum):
    """Audience of a parameter; the value is the heading in the docs and in ``--help``."""

    USER = 'Common parameters'
    VEHICLE = 'Parameters for vehicles'
    REST = 'Other parameters'
    SHIFT = "Parameters of the paper's rule"
    """They have an effect with code_source shift only; their names begin with ``shift.``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """Declaration of a parameter."""

    field: str
    """Name of the field of ``Parameters``."""
    default: Value
    description: str
    unit: str = ''
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[Value, ...] = ()
    read_only: bool = False
    group: Group = Group.REST

    def check(self, value: object) -> None:
        """
        Check that a value has the type of the default and is within the range or choices.

        Raises
        ------
        ParameterError
            The type or the value is not allowed; the message names the parameter.

        """
        if type(value) is not type(self.default):
            article = 'an' if self.type == 'integer' else 'a'
            hint = f', such as {value}.0' if self.type == 'double' and type(value) is int else ''
            raise ParameterError(
                f'parameter {self.name!r} is {value!r}: give {article} {self.type}{hint}')
        if not self._allows(value):
            raise ParameterError(
                f'parameter {self.name!r} is {value!r}: give {self.allowed}')

    def _allows(self, value: Any) -> bool:
        if self.minimum is None or self.maximum is None:
            return not self.choices or value in self.choices
        return bool(self.minimum <= value <= self.maximum)

    @property
    def name(self) -> str:
        """Return the name in ROS."""
        if self.group is Group.SHIFT:
            return self.field.replace('_', '.', 1)
        return self.field

    @property
    def type(self) -> str:  # noqa: A003
        """Return the name of the type in ROS."""
        return _ROS_TYPES[type(self.default)]

    @property
    def allowed(self) -> str:
        """Return the range or the choices as text; empty if any value is allowed."""
        if self.choices:
            return 'one of ' + ', '.join(map(str, self.choices))
        if self.minimum is None:
            return ''
        return f'{self.minimum:.12g} to {self.maximum:.12g}'


def parameter(default: Value, description: str, **details: Any) -> Any:
    """Return the field of a dataclass that declares a parameter; for the details, see ``Spec``."""
    return field(default=default, metadata={'description': description, **details})
