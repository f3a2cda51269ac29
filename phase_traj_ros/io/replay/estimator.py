# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the estimator from the parameters, with their mask, and feeds it frames."""

from dataclasses import replace

from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.errors import FrameError, ParameterError, SourceError
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.io.sources.mask_file import read_mask
from phase_traj_ros.parameters import Parameters


def make_estimator(parameters: Parameters, *, keep_all: bool = False) -> TrajectoryEstimator:
    """
    Return an estimator, bounded in memory unless ``keep_all``.

    Raises
    ------
    ParameterError
        The mask cannot be read, or it is empty within the band of rows and columns.

    """
    settings = parameters.estimator_settings()
    if keep_all:
        settings = replace(settings, max_runs=None, max_corners=None, max_speeds=None)
    try:
        return TrajectoryEstimator(settings, mask=read_mask(parameters))
    except ParameterError:
        raise
    except ValueError as error:
        raise ParameterError(str(error)) from None


def feed(
    estimator: TrajectoryEstimator, frame: StampedFrame, number: int, source: str,
) -> Update | None:
    """
    Feed frame ``number`` of a source to an estimator; return the result of its pair.

    Raises
    ------
    SourceError
        The frame cannot be used.

    """
    try:
        return estimator.update(frame.image, frame.stamp_ns, encoding=frame.encoding)
    except FrameError as error:
        raise SourceError(f'{source}: frame {number}: {error}') from None
