# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The method itself: frames in, codes and trajectory out.

Knows neither ROS nor files. A frame goes through ``PhaseCorrelator`` (shift), ``DynamicChainCode``
(codes) and ``ChainPath`` (trajectory); ``TrajectoryEstimator`` joins them for one camera.
"""

from phase_traj_ros.core.codes.codes import Direction, Movement, pack, unpack
from phase_traj_ros.core.codes.freeman import Freeman
from phase_traj_ros.core.codes.from_shift import ChainCode, DynamicChainCode, PAPER_THRESHOLD, Step
from phase_traj_ros.core.codes.series import CodeSeries, Run
from phase_traj_ros.core.correlation.phase_correlation import PhaseCorrelator, Shift
from phase_traj_ros.core.correlation.view import View
from phase_traj_ros.core.correlation.windows import Window
from phase_traj_ros.core.estimator import TrajectoryEstimator
from phase_traj_ros.core.path.trajectory import (
    Axes,
    ChainPath,
    Corner,
    normalised,
    to_axes,
    unit_step,
    vertices,
    yaw,
)
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings, PathSource
from phase_traj_ros.core.update import Counters, PairStatus, Update

__all__ = [
    'Axes',
    'ChainCode',
    'ChainPath',
    'CodeSeries',
    'CodeSource',
    'Corner',
    'Counters',
    'Direction',
    'DynamicChainCode',
    'EstimatorSettings',
    'Freeman',
    'Movement',
    'PAPER_THRESHOLD',
    'PairStatus',
    'PathSource',
    'PhaseCorrelator',
    'Run',
    'Shift',
    'Step',
    'TrajectoryEstimator',
    'Update',
    'View',
    'Window',
    'normalised',
    'pack',
    'to_axes',
    'unit_step',
    'unpack',
    'vertices',
    'yaw',
]
