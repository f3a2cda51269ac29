# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Offline replay: all frames of a source through the same estimator as the live node's."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from statistics import median

from phase_traj_ros.core import (
    CameraEstimate,
    CameraInUse,
    ChainCode,
    Counters,
    LengthUnit,
    Lens,
    LinkCode,
    Movement,
    PathSource,
    TrajectoryEstimator,
    TravelState,
    Update,
    Way,
)
from phase_traj_ros.core.calibration.field_of_view import FieldOfView
from phase_traj_ros.core.camera.projection import threshold_px
from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.core.codes.threshold_hint import ThresholdHint
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.reliability import Reliability
from phase_traj_ros.errors import FrameError, ParameterError, SourceError
from phase_traj_ros.io.replay.estimator import make_estimator
from phase_traj_ros.io.sources.base import Speed, StampedFrame
from phase_traj_ros.parameters import Parameters


@dataclass(frozen=True, slots=True)
class Replay:
    """What a replay has found, from the last reset (a backward jump of time) to the end."""

    source: str
    parameters: Parameters
    first_stamp_ns: int
    updates: tuple[Update, ...]
    codes: ChainCode
    counters: Counters
    turns: tuple[Turn, ...] = ()
    """The turns driven, where the camera's focal length or field of view is known."""
    focal_px: float | None = None
    """The focal length that heading and turns were measured with; None where they were not."""
    field_of_view: FieldOfView | None = None
    """What the turns tell of the field of view; None without any."""
    camera: CameraInUse | None = None
    """What the camera was taken for at the end; None where heading and turns were not measured."""
    reliability: Reliability = field(default_factory=Reliability)
    """Whether the codes can be relied upon, and if not, why."""
    threshold_hint: ThresholdHint | None = None
    """What to do about a threshold that does not fit; None if nothing shows."""
    learned: CameraEstimate | None = None
    """What this pass has learned of the camera; None without a turn, or if it was known."""
    way: Way = field(default_factory=Way)
    """How far the vehicle has gone; without any pairs where no distance is measured."""
    links: LinkCode | None = None
    """The chain code of equal links, where it was asked for."""

    @property
    def pairs_without_speed(self) -> int:
        """Return for how many pairs speeds were asked for, and neither one nor the road tells."""
        if not self.parameters.use_speed_topic:
            return 0
        return sum(update.odometry is None for update in self.updates)

    @property
    def path_unit(self) -> LengthUnit:
        """Return what the drawn path is in: steps where no distance was measured."""
        if self.parameters.drawn_from is PathSource.CODES:
            return LengthUnit.STEP
        told = self.parameters.metric or self.way.states[TravelState.MEASURED] > 0
        return self.parameters.length_unit if told else LengthUnit.STEP

    @property
    def threshold_px(self) -> float | None:
        """Return T in pixels per frame (at the median interval); None if the codes need none."""
        if self.parameters.codes_from_heading:
            return None
        if self.parameters.threshold_deg_s == 0.0 or self.focal_px is None:
            return self.parameters.threshold_px
        interval = median(update.interval_ns for update in self.updates) * 1e-9
        return threshold_px(self.parameters.threshold_deg_s, self.focal_px, interval)

    @property
    def frames(self) -> int:
        """Return how many frames the codes stand for: one more than the pairs."""
        return len(self.updates) + 1

    @property
    def movement(self) -> list[Movement]:
        """Return the movement codes, one per pair."""
        return [update.step.movement for update in self.updates]

    @property
    def direction(self) -> list[AnyDirection]:
        """Return the direction codes, one per pair that appends one."""
        return [update.step.direction for update in self.updates if update.step.appended]


class Watcher:
    """Sees each frame of a replay and what it adds, as it goes; frames are not to be changed."""

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Begin with the first frame, or anew with the one whose stamp went back."""

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take what a pair adds; ``frame`` is the second of the pair."""

    def finish(self, turns: Sequence[Turn]) -> None:
        """End after the last frame; ``turns`` are those under way there, which it ends."""


def replay(
    frames: Iterable[StampedFrame], parameters: Parameters, *, source: str,
    watchers: Sequence[Watcher] = (), lens: Lens | None = None, speeds: Iterable[Speed] = (),
) -> Replay:
    """
    Put all frames through an estimator, under the eyes of ``watchers``.

    ``source`` is what they come from, for reports. ``lens`` is what is known of its camera, and
    counts where the parameters do not say it. ``speeds`` are the vehicle's, in any order, and
    count where the parameters ask for them.

    Raises
    ------
    SourceError
        There are fewer than two frames, or one of them cannot be used.
    ParameterError
        Parameters ask for the camera's calibration, and there is none.

    """
    estimator = make_estimator(parameters, keep_all=True)
    if lens is not None and estimator.settings.lens is None and (
            estimator.settings.measures_heading):
        estimator.use_lens(lens)
    elif estimator.settings.awaits_lens:
        raise ParameterError(
            f'{source} does not say what its camera is like, and a focal length is needed:'
            ' give focal_px or hfov_deg, or code_source auto')
    # All at once, and in the order of their stamps: whatever comes late or twice in a bag.
    for speed in sorted(speeds, key=lambda each: each.stamp_ns):
        estimator.add_speed(speed.stamp_ns, speed.speed)
    updates: list[Update] = []
    turns: list[Turn] = []
    first_stamp_ns = 0
    for number, frame in enumerate(frames):
        repeated = frame.stamp_ns == estimator.last_stamp_ns
        update = _update(estimator, frame, number, source)
        if update is not None:
            updates.append(update)
            turns += update.turns
            for watcher in watchers:
                watcher.add(frame, update, estimator)
        elif not repeated:
            updates.clear()
            turns.clear()
            first_stamp_ns = frame.stamp_ns
            for watcher in watchers:
                watcher.start(frame, estimator)
    if not updates:
        raise SourceError(
            f'{source}: {estimator.frames} frame{"" if estimator.frames == 1 else "s"}'
            ' to use, but a trajectory takes at least two, with different stamps')
    heading = estimator.heading
    under_way = [] if heading is None else sorted(heading.finish(), key=_start_frame)
    for watcher in watchers:
        watcher.finish(under_way)
    found = Replay(
        source, parameters, first_stamp_ns, tuple(updates), estimator.codes, estimator.counters,
        tuple(sorted([*turns, *under_way], key=_start_frame)),
        reliability=estimator.reliability, threshold_hint=estimator.threshold_hint,
        way=estimator.way, links=estimator.links)
    if heading is None:
        return found
    return replace(
        found, focal_px=heading.focal_px, field_of_view=heading.field_of_view,
        camera=heading.camera, learned=heading.learned)


def _start_frame(turn: Turn) -> int:
    return turn.start_frame


def _update(
    estimator: TrajectoryEstimator, frame: StampedFrame, number: int, source: str,
) -> Update | None:
    try:
        return estimator.update(frame.image, frame.stamp_ns, encoding=frame.encoding)
    except FrameError as error:
        raise SourceError(f'{source}: frame {number}: {error}') from None
