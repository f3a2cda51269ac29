# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks changes of parameters while the node runs."""

import numpy as np
from phase_traj_ros.core import TrajectoryEstimator
from phase_traj_ros.core.correlation.phase_correlation import MIN_SIDE
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.parameters import Parameters


def check_change(
    estimator: TrajectoryEstimator, values: Parameters, shape: tuple[int, ...] | None,
) -> None:
    """
    Check that ``estimator`` can continue with other values and loses nothing.

    Parameters
    ----------
    estimator
        The estimator in use.
    values
        The new values of all parameters.
    shape
        Shape of the newest frame, (H, W); None before the first one.

    Raises
    ------
    ValueError
        A value cannot change while the estimator runs, would restart the codes, or leaves nothing
        of the frames.

    """
    settings, used = values.settings, estimator.settings
    estimator.check(settings)
    if estimator.frames and settings.code_source is not used.code_source:
        raise ParameterError(
            'a threshold selects what the codes are made from: it would restart them, with'
            f' code_source {settings.code_source.value} instead of {used.code_source.value}; set'
            ' it at the start, or call ~/reset first')
    if shape is not None and settings.view != used.view:
        band = settings.view.of(np.broadcast_to(np.uint8(0), shape)).shape
        if min(band) < MIN_SIDE:
            raise ParameterError(
                f'shift.decimation leaves {band[1]}x{band[0]} pixels of images of'
                f' {shape[1]}x{shape[0]}: leave at least {MIN_SIDE}x{MIN_SIDE}')
