# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the diagnostics say about the measurement."""

from phase_traj_ros.core import TrajectoryEstimator
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.io.messages.diagnostics import MeasurementReporter
from phase_traj_ros.parameters import Parameters


def test_the_library_in_use_is_named_with_its_version():
    estimator = TrajectoryEstimator(Parameters().settings)
    told = MeasurementReporter().report(estimator, 0.0).values['transforms']
    assert told == find_transform().name


def test_the_drive_has_a_verdict_beside_that_of_the_last_minute():
    estimator = TrajectoryEstimator(Parameters().settings)
    told = MeasurementReporter().report(estimator, 0.0).values
    assert told['drive reliable'] == str(estimator.reliability.of_drive.reliable).lower()
    assert told['unreliable spans'] == str(len(estimator.reliability.spans))
