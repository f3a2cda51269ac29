# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The method: frames in, codes and trajectory out.

The core depends neither on ROS nor on files. ``TrajectoryEstimator`` takes each frame through four
steps: ``frames.prepare`` (check and convert it), ``measuring`` (compare it with earlier ones),
``judge`` (its status and quality) and ``integration`` (heading, codes, distance, path).
``FrameStream`` feeds it the frames of a camera as they arrive, late and broken ones included.
"""

from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import Lens, LensOrigin
from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.core.codes.chain import ChainCode, Step
from phase_traj_ros.core.codes.codes import Direction, Movement, pack, unpack
from phase_traj_ros.core.codes.freeman import Freeman
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.from_shift import DynamicChainCode, PAPER_THRESHOLD
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.codes.series import CodeSeries, Run
from phase_traj_ros.core.codes.text import (
    ChainCodeText,
    LinksText,
    parse_chain_code,
    parse_links,
    SeriesText,
)
from phase_traj_ros.core.correlation.phase_correlation import PhaseCorrelator, Shift
from phase_traj_ros.core.correlation.quality import GateSettings, StillnessSettings
from phase_traj_ros.core.correlation.view import View
from phase_traj_ros.core.estimator import TrajectoryEstimator
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.heading.turns import find_turns, Turn
from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.core.localization.given import OdometryStep, PositionFix, Prior, ScaleRange
from phase_traj_ros.core.localization.locator import MapLocator
from phase_traj_ros.core.localization.roads import RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.path.odometry import Odometry
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
from phase_traj_ros.core.path.way import LengthUnit, Way
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings, PathSource
from phase_traj_ros.core.status import PairStatus
from phase_traj_ros.core.stream import FrameStream, Measured, Outcome, Restarted, Skipped, Started
from phase_traj_ros.core.update import Counters, Update

__all__ = [
    'Axes',
    'CameraEstimate',
    'CameraInUse',
    'CameraModel',
    'Candidate',
    'ChainCode',
    'ChainCodeText',
    'ChainPath',
    'CodeSeries',
    'CodeSource',
    'Corner',
    'Counters',
    'Direction',
    'Distortion',
    'DynamicChainCode',
    'EstimatorSettings',
    'FrameStream',
    'Freeman',
    'GateSettings',
    'HeadingCode',
    'HeadingStep',
    'Horizon',
    'LengthUnit',
    'Lens',
    'LensOrigin',
    'LinkCode',
    'LinksText',
    'LocationEstimate',
    'LocatorSettings',
    'MapLocator',
    'Measured',
    'Movement',
    'Odometry',
    'OdometryStep',
    'Outcome',
    'PAPER_THRESHOLD',
    'PairStatus',
    'PathSource',
    'PhaseCorrelator',
    'PositionFix',
    'Prior',
    'Restarted',
    'RoadMap',
    'Run',
    'ScaleRange',
    'SeriesText',
    'Shift',
    'Skipped',
    'Started',
    'Step',
    'StillnessSettings',
    'TrajectoryEstimator',
    'Travel',
    'TravelState',
    'Turn',
    'Update',
    'View',
    'Way',
    'find_turns',
    'normalised',
    'pack',
    'parse_chain_code',
    'parse_links',
    'to_axes',
    'unit_step',
    'unpack',
    'vertices',
    'yaw',
]
