# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera of a recording: given by the source, or learned from the drive."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from phase_traj_ros.core import Lens, Skipped
from phase_traj_ros.errors import CalibrationError, PhaseTrajError, SourceError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.estimator import described, make_estimator, outcomes, too_few
from phase_traj_ros.io.sources.base import Entry, FrameSource, UnreadableFrame
from phase_traj_ros.parameters import Parameters

# Smallest interval of the frames from which the camera is learned, in nanoseconds: those of 30 Hz
# are all used. With every second one, focal lengths from strongly compressed films were 2.1 % off
# instead of 1.0 %, and fewer turns gave one.
_SOON_NS = 19_000_000
# Parts of turns after which further ones would not change the camera by more than its error.
_ENOUGH_TURNS = 8


def mounting_of(source: FrameSource, parameters: Parameters) -> Mounting:
    """Return the parameters with the mount of the camera, if the source has a usable one."""
    try:
        mount = source.mount(parameters.child_frame_id)
        return Mounting(parameters) if mount is None else mount.fill_in(parameters)
    except PhaseTrajError as error:
        return Mounting(parameters, doubts=(f'/tf_static is not used: {error}',))


def known_lens(source: FrameSource, parameters: Parameters) -> tuple[Lens | None, str]:
    """
    Return the lens that the source gives, if the parameters need one; None otherwise.

    The text says why a calibration in the source is not used; it is empty otherwise.

    Raises
    ------
    SourceError
        The calibration cannot be read.
    CalibrationError
        The calibration cannot be used, and the camera is not learned from the drive.

    """
    settings = parameters.settings
    if not (settings.awaits_lens or settings.learns_lens):
        return None, ''
    try:
        camera = source.camera(rectified=parameters.rectified)
    except CalibrationError as error:
        if settings.learns_lens:
            return None, str(error)
        raise
    return None if camera is None else parameters.calibrated(camera), ''


def learned_lens(
    frames: Iterable[Entry], parameters: Parameters, source: str, *, strict: bool = False,
) -> Lens | None:
    """
    Return the camera learned from the frames, up to the one at which it is known well.

    None if nothing was learned, or if the parameters do not ask for it. More than 50 frames per
    second would not add information, so the rest is left out.

    Raises
    ------
    SourceError
        Fewer than two frames can be used, or, with ``strict``, not all.

    """
    # Only the road tells whether the vehicle stands, and traffic that crosses looks like a turn.
    estimator = make_estimator(replace(
        parameters, path_from='heading', speed=0.0, use_speed_topic=False, camera_height=0.0,
        code_step=0.0))
    heading = estimator.heading
    if heading is None or not estimator.settings.learns_lens:
        return None
    first_skipped = ''
    for outcome in outcomes(estimator, _thinned(frames), source=source, strict=strict):
        if isinstance(outcome, Skipped):
            first_skipped = first_skipped or described(outcome)
        # Not the camera in use, which stays while what is learned does not differ from it.
        so_far = heading.camera.learned
        if so_far is not None and so_far.turns >= _ENOUGH_TURNS:
            break
    counters = estimator.counters
    if estimator.frames < 2 and counters.skipped + counters.dropped + counters.repeated:
        raise SourceError(f'{source}: {too_few(estimator, first_skipped)}')
    heading.finish()
    learned = heading.camera.learned
    return None if learned is None else Lens(estimate=learned)


def _thinned(entries: Iterable[Entry]) -> Iterator[Entry]:
    """Yield the entries without the frames that follow closely on another one."""
    last_ns = None
    for entry in entries:
        if isinstance(entry, UnreadableFrame):
            yield entry
        elif last_ns is None or not 0 < entry.stamp_ns - last_ns < _SOON_NS:
            last_ns = entry.stamp_ns
            yield entry
