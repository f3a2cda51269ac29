# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The status of the measurement on /diagnostics, live and in a bag written offline."""

from dataclasses import asdict, dataclass, replace
from enum import IntEnum

from phase_traj_ros.core import Counters, TrajectoryEstimator
from phase_traj_ros.core.camera.estimate import FieldOfView
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.core.reliability.reason import Reason

# Below this share of measured pairs since the last report, the status is a warning.
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
    """Reports whether the shift can be measured; the level covers the time since the last."""

    def __init__(self) -> None:
        """Start with all counters at zero."""
        self._counted = Counters()

    def skip(self, estimator: TrajectoryEstimator) -> None:
        """Leave out what has been counted so far."""
        self._counted = replace(estimator.counters)

    def report(self, estimator: TrajectoryEstimator, response: float) -> Report:
        """Return the status; ``response`` is the median response of the newest pairs."""
        counters, heading = estimator.counters, estimator.heading
        found = estimator.reliability
        values = {
            'transforms': find_transform().name,
            'reliable': str(found.reliable).lower(), 'reasons': ' '.join(found.words),
            'drive reliable': str(found.of_drive.reliable).lower(),
            'unreliable spans': str(len(found.spans))}
        if heading is not None:
            values['bridged share'] = f'{heading.tracker.bridged_share:.3f}'
            camera = heading.camera
            if camera.in_use is not None:
                values['camera'] = str(camera.in_use)
            if camera.field_of_view is not None:
                values.update(_view_values(camera.field_of_view))
        values.update(_way_values(estimator))
        pairs = counters.frames - self._counted.frames
        unusable = sum(
            getattr(counters, name) - getattr(self._counted, name) for name in _UNUSABLE)
        self.skip(estimator)
        if pairs and unusable > (1 - _MEASURED_SHARE) * pairs:
            level, message = Level.WARN, f'{unusable} of {pairs} pairs not measured'
        elif (pairs or Reason.FROZEN in found.reasons) and any(
                reason is not Reason.TOO_SHORT for reason in found.reasons):
            level = Level.WARN
            message = ' '.join(reason.sentence for reason in found.reasons)
        elif pairs:
            level, message = Level.OK, 'measuring'
        else:
            level, message = Level.OK, 'nothing to measure'
        counted = {
            name: str(value) for name, value in asdict(counters).items() if name != 'frames'}
        return Report(level, message, {
            'frames': str(counters.frames), 'response (median)': f'{response:.3f}', **counted,
            **values})


def _way_values(estimator: TrajectoryEstimator) -> dict[str, str]:
    """Return distance, speed and counts of distance states; empty if no distance is measured."""
    way, unit = estimator.way, estimator.settings.length_unit.value
    if not way.pairs:
        return {}
    speed = 'unknown' if way.speed is None else f'{way.speed:.2f}'
    return {
        f'distance ({unit})': str(way), f'speed ({unit}/s)': speed,
        **{f'distance {state.value}': str(count) for state, count in way.states.items()}}


def _view_values(view: FieldOfView) -> dict[str, str]:
    return {
        'field of view (deg)': f'{view.hfov_deg:.1f}',
        'field of view deviation (deg)': f'{view.deviation_deg:.1f}',
        'field of view sureness': f'{view.sureness:.2f}',
        'field of view turns': str(view.turns)}
