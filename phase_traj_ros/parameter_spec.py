# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Declarations of parameters: type, default, range or choices, unit, description."""

from dataclasses import dataclass, field
from enum import Enum
import sys
from types import MappingProxyType
from typing import Any, cast, Final, TypeAlias

from phase_traj_ros.errors import ParameterError

Value: TypeAlias = 'bool | int | float | str'

_ROS_TYPES = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}
# Any finite number of zero or more.
NOT_NEGATIVE: dict[str, Any] = {'minimum': 0.0, 'maximum': sys.float_info.max}

_CONSTANT = 'it is a constant now; leave it out'
_MASKED = 'leave the area out with mask_file'
# Parameters of earlier versions, and what to do instead.
REMOVED: Final = MappingProxyType({
    'estimate_fov': 'code_source auto learns an unknown camera; leave it out',
    'threshold_deg_s': 'give threshold in px/frame, or leave both out (code_source auto)',
    'transform': 'the fastest library that is installed is used; leave it out',
    'speed_type': 'the type is that of the topic; leave it out',
    'record_shifts': 'record the topics with ros2 bag record; leave it out',
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
    step: int = 1
    choices: tuple[str, ...] = ()
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
            raise ParameterError(
                f'parameter {self.name!r} is {value!r}: give {article} {self.type}'
                f'{self._hint(value)}')
        if value not in self.choices if self.choices else not self._in_range(value):
            raise ParameterError(
                f'parameter {self.name!r} is {value!r}: give {self.allowed}')

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
    def is_open(self) -> bool:
        """Return whether the range has no upper limit; tools cannot use such a range."""
        return self.maximum == sys.float_info.max

    @property
    def allowed(self) -> str:
        """Return the range or the choices as text; empty if any value is allowed."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        if self.minimum is None:
            return ''
        if self.is_open:
            return 'a finite number of 0 or more'
        if self.step > 1:
            return f'{self.minimum:.12g} to {self.maximum:.12g} in steps of {self.step}'
        return f'{self.minimum:.12g} to {self.maximum:.12g}'

    def _hint(self, value: object) -> str:
        """Return how to write a number that is not yet a double, such as 3 and 1e1."""
        if self.type != 'double' or type(value) not in (int, str):
            return ''
        try:
            meant = repr(float(cast('int | str', value)))
        except (OverflowError, ValueError):
            return ''
        return f', such as {meant}' if '.' in meant else ''

    def _in_range(self, value: object) -> bool:
        if self.minimum is None or self.maximum is None:
            return True
        return (
            isinstance(value, (int, float)) and self.minimum <= value <= self.maximum
            and (self.step == 1 or (value - self.minimum) % self.step == 0))


def parameter(default: Value, description: str, **details: Any) -> Any:
    """Return the field of a dataclass that declares a parameter; for the details, see ``Spec``."""
    return field(default=default, metadata={'description': description, **details})
