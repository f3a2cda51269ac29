# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a recording's camera: from the source itself, or learned from the drive."""

from collections.abc import Iterable

from phase_traj_ros.core import Lens
from phase_traj_ros.errors import CalibrationError
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import FrameSource, StampedFrame
from phase_traj_ros.parameters import Parameters


def known_lens(source: FrameSource, parameters: Parameters) -> Lens | None:
    """
    Return what the source says of its camera, where that counts; None if it says nothing.

    Raises
    ------
    SourceError
        The calibration cannot be read.
    CalibrationError
        The calibration cannot be used, and the camera is not learned from the drive.

    """
    settings = parameters.estimator_settings()
    if not (settings.awaits_lens or settings.learns_lens):
        return None
    try:
        camera = source.camera(rectified=parameters.rectified)
    except CalibrationError:
        if settings.learns_lens:
            return None
        raise
    return None if camera is None else Lens(camera=camera)


def learned_lens(
    frames: Iterable[StampedFrame], parameters: Parameters, source: str,
) -> Lens | None:
    """
    Return what a pass over all frames tells of the camera; None if nothing does, or need not.

    Raises
    ------
    SourceError
        There are fewer than two frames, or one of them cannot be used.

    """
    if not parameters.estimator_settings().learns_lens:
        return None
    estimate = replay(frames, parameters, source=source).learned
    return None if estimate is None else Lens(estimate=estimate)
