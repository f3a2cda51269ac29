# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera of a recording: given by the source, or learned from the drive."""

from collections.abc import Iterable

from phase_traj_ros.core import Lens
from phase_traj_ros.errors import CalibrationError
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import FrameSource, StampedFrame
from phase_traj_ros.parameters import Parameters


def known_lens(source: FrameSource, parameters: Parameters) -> Lens | None:
    """
    Return the lens that the source gives, if the parameters need one; None otherwise.

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
    Return the camera learned in a pass over all frames.

    None if nothing was learned, or if the parameters do not ask for it.

    Raises
    ------
    SourceError
        There are fewer than two frames, or one of them cannot be used.

    """
    if not parameters.estimator_settings().learns_lens:
        return None
    estimate = replay(frames, parameters, source=source).learned
    return None if estimate is None else Lens(estimate=estimate)
