# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the diagnostics say about the measurement."""

import cv2
from phase_traj_ros.core import TrajectoryEstimator
from phase_traj_ros.core.correlation.transforms import scipy_is_installed
from phase_traj_ros.io.messages.diagnostics import MeasurementReporter
from phase_traj_ros.parameters import Parameters
import pytest


@pytest.mark.parametrize('library', ['opencv', 'scipy'])
def test_the_library_in_use_is_named_with_its_version(library):
    if library == 'scipy' and not scipy_is_installed():
        pytest.skip('without scipy')
    estimator = TrajectoryEstimator(Parameters(transform=library).estimator_settings())
    told = MeasurementReporter().report(estimator, 0.0).values['transforms']
    if library == 'opencv':
        assert told.startswith(f'OpenCV {cv2.__version__}')
    else:
        import scipy
        assert told.startswith(f'scipy {scipy.__version__}')
