# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The parameters, declared once for the node, the command line and the docs.

Knows nothing of rclpy: ``phase_traj_ros.ros.declare`` declares this table on a node, and
``phase_traj_ros.io.params_file`` reads it from a ROS parameter file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, MISSING, replace
from difflib import get_close_matches
from functools import cache
import sys
from typing import Any, cast, TypeAlias

from phase_traj_ros.core import EstimatorSettings, PAPER_THRESHOLD, Window
from phase_traj_ros.errors import ParameterError

NODE_NAME = 'phase_traj'

Value: TypeAlias = 'bool | int | float | str'

_ROS_TYPES = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}
# As a range has to be given: any finite number above zero.
_POSITIVE: dict[str, Any] = {'minimum': sys.float_info.min, 'maximum': sys.float_info.max}


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """What is declared of one parameter."""

    name: str
    default: Value
    description: str
    unit: str
    minimum: float | None
    maximum: float | None
    choices: tuple[str, ...]
    read_only: bool

    def check(self, value: object) -> None:
        """
        Accept a value of the default's type, within the range or among the choices.

        Raises
        ------
        ParameterError
            It is not; the message names the parameter and says what it takes.

        """
        if type(value) is not type(self.default):
            hint = f', so write {value}.0' if type(value) is int and self.type == 'double' else ''
            raise ParameterError(
                f'parameter {self.name!r} is {value!r}: it takes a {self.type}{hint}')
        if value not in self.choices if self.choices else not self._in_range(value):
            raise ParameterError(
                f'parameter {self.name!r} is {value!r}: it takes {self.allowed}')

    @property
    def type(self) -> str:  # noqa: A003
        """Return the type's name in ROS."""
        return _ROS_TYPES[type(self.default)]

    @property
    def allowed(self) -> str:
        """Return the range or the choices in words, empty where any value goes."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        if self.minimum is None:
            return ''
        if self.minimum == sys.float_info.min:
            return 'a finite number above 0'
        return f'{self.minimum:.12g} to {self.maximum:.12g}'

    def _in_range(self, value: object) -> bool:
        if self.minimum is None or self.maximum is None:
            return True
        return isinstance(value, (int, float)) and self.minimum <= value <= self.maximum


def _parameter(
    default: Value, description: str, *, unit: str = '', minimum: float | None = None,
    maximum: float | None = None, choices: tuple[str, ...] = (), read_only: bool = False,
) -> Any:
    return field(default=default, metadata={
        'description': description, 'unit': unit, 'minimum': minimum, 'maximum': maximum,
        'choices': choices, 'read_only': read_only})


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """
    One set of values for all parameters; the defaults are the paper's.

    Raises
    ------
    ParameterError
        A value is of the wrong type or out of its range.

    """

    threshold: float = _parameter(
        PAPER_THRESHOLD, 'Horizontal shift between two frames from which a pair counts as a turn.',
        unit='px/frame', **_POSITIVE)
    window: str = _parameter(
        Window.SQRT_HANN.value, 'Taper of the frames before they are correlated.',
        choices=tuple(form.value for form in Window), read_only=True)
    frame_id: str = _parameter(
        'phase_traj', 'Frame of the published pose and path. The path has no metric scale, so it'
        ' is not odom.')
    step_length: float = _parameter(
        1.0, 'Length drawn for each direction code.', unit='m', **_POSITIVE)
    max_path_poses: int = _parameter(
        1000, 'Poses of the published path: corner points, oldest dropped first, and the tip.',
        minimum=2, maximum=100_000, read_only=True)
    path_rate: float = _parameter(
        5.0, 'The path is published at most this often, and only when it has changed.',
        unit='Hz', minimum=0.1, maximum=100.0, read_only=True)
    chain_code_runs: int = _parameter(
        50, 'Runs of each code that the chain code text shows, the newest ones.',
        minimum=1, maximum=1000)
    max_runs: int = _parameter(
        100_000, 'Runs of each code that the node keeps; the totals count all of them.',
        minimum=1000, maximum=10_000_000, read_only=True)

    def __post_init__(self) -> None:
        """Check every value against its declaration."""
        for spec in specs():
            spec.check(getattr(self, spec.name))

    def with_values(self, values: Mapping[str, object]) -> 'Parameters':
        """
        Return a copy with some values replaced.

        Raises
        ------
        ParameterError
            A name is unknown, or a value is not allowed.

        """
        known = [spec.name for spec in specs()]
        for name in values:
            if name not in known:
                near = get_close_matches(name, known, n=1)
                hint = f'did you mean {near[0]!r}?' if near else f'known are {", ".join(known)}'
                raise ParameterError(f'there is no parameter {name!r}: {hint}')
        return replace(self, **cast('dict[str, Any]', dict(values)))

    def estimator_settings(self) -> EstimatorSettings:
        """Return the settings of a live estimator, bounded in memory."""
        return EstimatorSettings(
            threshold=self.threshold,
            window=Window(self.window),
            max_runs=self.max_runs,
            # The tip is one of the poses.
            max_corners=self.max_path_poses - 1,
        )


@cache
def specs() -> tuple[Spec, ...]:
    """Return the declarations of all parameters, in the order of the table."""
    table = []
    for declared in fields(Parameters):
        assert declared.default is not MISSING
        table.append(Spec(name=declared.name, default=declared.default, **declared.metadata))
    return tuple(table)
