# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What /diagnostics says about the measurement, live and in a bag written offline."""

from dataclasses import dataclass
from enum import IntEnum

from phase_traj_ros.core import Counters

# Below this share of measured pairs, since the last report, something is wrong with the view.
_MEASURED_SHARE = 0.5
_UNUSABLE = ('unmeasured', 'gaps', 'reprimed')


class Level(IntEnum):
    """The levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Report:
    """One status; the values are shown in their order."""

    level: Level
    message: str
    values: dict[str, str]


class MeasurementReporter:
    """Reports whether the shift can be measured; the level is about the time since the last."""

    def __init__(self) -> None:
        """Begin with everything at zero."""
        self._counted = Counters()

    def report(self, counters: Counters, response: float) -> Report:
        """Return what there is to say; ``response`` is the median of the newest pairs."""
        pairs = counters.frames - self._counted.frames
        unusable = sum(
            getattr(counters, name) - getattr(self._counted, name) for name in _UNUSABLE)
        self._counted = counters.copy()
        if pairs and unusable > (1 - _MEASURED_SHARE) * pairs:
            level, message = Level.WARN, f'{unusable} of {pairs} pairs not measured'
        elif pairs:
            level, message = Level.OK, 'measuring'
        else:
            level, message = Level.OK, 'nothing to measure'
        counted = {
            name: str(value) for name, value in counters.as_dict().items() if name != 'frames'}
        return Report(level, message, {
            'frames': str(counters.frames), 'response (median)': f'{response:.3f}', **counted})
