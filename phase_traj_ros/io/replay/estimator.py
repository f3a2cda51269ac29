# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the estimator from the parameters, with their mask, and feeds it frames."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from phase_traj_ros.core import FrameStream, Outcome, Skipped, TrajectoryEstimator
from phase_traj_ros.errors import ParameterError, SourceError
from phase_traj_ros.io.images.decoding import read_picture
from phase_traj_ros.io.sources.base import Entry, StampedFrame, UnreadableFrame
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.parameters import Parameters


def make_estimator(parameters: Parameters, *, keep_all: bool = False) -> TrajectoryEstimator:
    """
    Return an estimator, bounded in memory; with ``keep_all`` it keeps all codes and speeds.

    Raises
    ------
    ParameterError
        The mask cannot be read, or it is empty: black everywhere, or within the view.

    """
    settings = parameters.settings
    if keep_all:
        settings = replace(settings, max_runs=None, max_speeds=None)
    try:
        file = parameters.mask_file
        mask = read_picture(user_path(file)) if file else None
        return TrajectoryEstimator(settings, mask=mask)
    except (SourceError, ValueError) as error:
        # The parameters have checked the settings.
        raise ParameterError(f'mask_file: {error}') from None


def outcomes(
    estimator: TrajectoryEstimator, entries: Iterable[Entry], *, source: str, strict: bool = False,
) -> Iterator[Outcome[StampedFrame] | Skipped[UnreadableFrame]]:
    """
    Feed all frames of a source to an estimator; yield what came of each.

    Raises
    ------
    SourceError
        A frame cannot be used, and ``strict`` is set.

    """
    stream: FrameStream[StampedFrame] = FrameStream(estimator)
    for entry in entries:
        if isinstance(entry, UnreadableFrame):
            stream.skip()
            found: Iterable[Outcome[StampedFrame] | Skipped[UnreadableFrame]] = [
                Skipped(entry, entry.reason)]
        else:
            found = stream.push(entry)
        for outcome in found:
            if strict and isinstance(outcome, Skipped):
                raise SourceError(f'{source}: {described(outcome)}')
            yield outcome
    yield from stream.finish()


def described(skipped: Skipped[StampedFrame] | Skipped[UnreadableFrame]) -> str:
    """Return the number of a skipped frame, if it is known, and why it was skipped."""
    number = skipped.frame.number
    return skipped.reason if number is None else f'frame {number}: {skipped.reason}'


def too_few(estimator: TrajectoryEstimator, first_skipped: str) -> str:
    """Return why there is no trajectory."""
    used, counters = estimator.frames, estimator.counters
    unused = [
        f'{count} {what}' for count, what in (
            (counters.repeated, 'repeated'), (counters.dropped, 'with a stamp out of order'),
            (counters.skipped, f'skipped ({first_skipped})')) if count]
    return (
        f'{used} frame{"" if used == 1 else "s"} to use{"".join(f", {each}" for each in unused)},'
        ' but a trajectory needs at least two, with different stamps')
