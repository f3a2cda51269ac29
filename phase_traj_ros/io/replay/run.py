# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Offline replay: runs all frames of a source through the estimator that the node uses."""

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from phase_traj_ros.core import (
    CameraEstimate,
    CameraInUse,
    ChainCode,
    Counters,
    Lens,
    LensOrigin,
    LinkCode,
    Measured,
    Movement,
    Restarted,
    Skipped,
    Started,
    TrajectoryEstimator,
    TravelState,
    Update,
    Way,
)
from phase_traj_ros.core.camera.estimate import FieldOfView
from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.core.codes.threshold_hint import ThresholdHint
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.errors import ParameterError, SourceError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.estimator import described, make_estimator, outcomes, too_few
from phase_traj_ros.io.replay.kept_updates import KeptUpdates
from phase_traj_ros.io.sources.base import Entry, SourceFrames, Speed, StampedFrame
from phase_traj_ros.parameters import Parameters

# The number of a frame, where its source does not tell it.
_UNKNOWN = -1


@dataclass(frozen=True, slots=True)
class Replay:
    """Results of a replay, from the last reset (a jump of the stamps) to the end."""

    source: str
    mounting: Mounting
    """The parameters, with the mount of the camera."""
    first_stamp_ns: int
    updates: Sequence[Update]
    codes: ChainCode
    counters: Counters
    turns: tuple[Turn, ...] = ()
    """The turns driven; empty if the heading was not measured."""
    field_of_view: FieldOfView | None = None
    """Field of view as learned from the turns; None without any."""
    camera: CameraInUse | None = None
    """Camera in use at the end; None if heading and turns were not measured."""
    reliability: Reliability = field(default_factory=Reliability)
    """Whether the codes are reliable, and if not, why."""
    threshold_hint: ThresholdHint | None = None
    """What to do about a threshold that does not fit; None if it may fit."""
    learned: CameraEstimate | None = None
    """Camera learned in this pass; None without a turn, or if the camera was known."""
    way: Way = field(default_factory=Way)
    """Distance travelled; it has no pairs if no distance is measured."""
    links: LinkCode | None = None
    """The chain code of equal links, if the parameters ask for it."""
    frame_numbers: Sequence[int] | None = None
    """Number of each frame in its source, before the selection; None if not known."""
    source_frames: SourceFrames = field(default_factory=SourceFrames)
    """How many frames the source has, as far as it is known."""
    unused_calibration: str = ''
    """Why the calibration in the source is not used; empty if it is, or there is none."""
    unused_speeds: str = ''
    """Why none of the speeds is used; empty if one is, or none is asked for."""
    first_skipped: str = ''
    """The first frame that was skipped, and why; empty if there is none."""

    @property
    def parameters(self) -> Parameters:
        """Return the parameters in use."""
        return self.mounting.parameters

    @property
    def problems(self) -> tuple[str, ...]:
        """Return what is wrong with the source, in sentences without capital and full stop."""
        unused = self.unused_calibration and (
            f'the calibration is not used: {self.unused_calibration}')
        return tuple(
            each for each in (
                self.source_frames.problem, unused, self.unused_speeds, *self.mounting.doubts)
            if each)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what is wrong with the settings and the data, likewise."""
        skipped, counters = self.counters.skipped, self.counters
        counted = (
            (counters.repeated, 'frames with the stamp or the image of the previous one'),
            (counters.dropped, 'frames dropped, as their stamps are out of order'),
            (counters.time_resets, 'new starts of the codes, as the stamps jumped'),
            (sum(update.cut for update in self.updates), 'cuts to a new scene'),
            (counters.unmeasured, 'pairs that could not be measured'),
            (counters.reprimed, 'changes of the size or the type of the frames'),
            (0 if self.way.distance is None else self.way.states[TravelState.UNKNOWN],
             'pairs of unknown distance, which are not counted'))
        return (
            *self.parameters.notices, *self.problems,
            *([f'frames skipped: {skipped}; the first: {self.first_skipped}'] if skipped else []),
            *(f'{what}: {count}' for count, what in counted if count))

    @property
    def assumes_camera(self) -> bool:
        """Return whether the distance depends on a camera that no turn has determined."""
        settings = self.parameters.settings
        # A height that is learned from speeds has the error of the camera.
        by_speeds = settings.metric and settings.camera_height == 0.0
        return (self.camera is not None and self.camera.origin is LensOrigin.ASSUMED
                and self.way.measured and not by_speeds)

    @property
    def frames(self) -> int:
        """Return the number of frames that the codes cover: one more than the pairs."""
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
    """Receives each frame of a replay and its result; must not change the frames."""

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start with the first frame, or again with the one at which the stamps restart."""

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the result of a pair; ``frame`` is its second frame."""


def replay(
    frames: Iterable[Entry], parameters: Parameters, *, source: str,
    watchers: Sequence[Watcher] = (), lens: Lens | None = None, speeds: Iterable[Speed] = (),
    strict: bool = False,
) -> Replay:
    """
    Run all frames through an estimator, and pass the results to ``watchers``.

    ``source`` describes the origin of the frames, for reports. ``lens`` is the known lens of the
    camera; parameters override it. ``speeds`` are those of the vehicle, in any order; they are
    used if the parameters ask for them. Frames that cannot be used are skipped, unless ``strict``.

    Raises
    ------
    SourceError
        There are fewer than two frames to use, or, with ``strict``, one that cannot be used.
    ParameterError
        The parameters need a calibration of the camera, and there is none.

    """
    estimator = make_estimator(parameters, keep_all=True)
    if lens is not None and estimator.settings.lens is None and (
            estimator.settings.measures_heading):
        estimator.use_lens(lens)
    elif estimator.settings.awaits_lens:
        raise ParameterError(
            f'{source} does not contain a calibration, and a focal length is required:'
            ' give focal_px or hfov_deg, or code_source auto')
    # All at once, sorted by stamp: in a bag they may be late or repeated.
    given = sorted(speeds, key=lambda each: each.stamp_ns)
    for speed in given:
        estimator.add_speed(speed.stamp_ns, speed.speed)
    updates = KeptUpdates()
    numbers = array('q')
    first_stamp_ns = 0
    first_skipped = ''
    for outcome in outcomes(estimator, frames, source=source, strict=strict):
        match outcome:
            case Measured(frame, update):
                updates.append(update)
                numbers.append(_UNKNOWN if frame.number is None else frame.number)
                for watcher in watchers:
                    watcher.add(frame, update, estimator)
            case Started(frame):
                numbers.append(_UNKNOWN if frame.number is None else frame.number)
                first_stamp_ns = frame.stamp_ns
                for watcher in watchers:
                    watcher.start(frame, estimator)
            case Restarted():
                updates = KeptUpdates()
                del numbers[:]
            case Skipped():
                first_skipped = first_skipped or described(outcome)
    if not updates:
        raise SourceError(f'{source}: {too_few(estimator, first_skipped)}')
    unused_speeds = ''
    way = estimator.way
    if parameters.use_speed_topic and way.pairs and not way.states[TravelState.GIVEN]:
        known = 'none is valid' if not given else (
            f'{len(given)} from {given[0].stamp_ns / 1e9:.3f} to {given[-1].stamp_ns / 1e9:.3f} s,'
            f' images from {first_stamp_ns / 1e9:.3f} to {updates[-1].stamp_ns / 1e9:.3f} s')
        unused_speeds = f'no speed for the stamp of an image ({known})'
    heading = estimator.heading
    under_way = [] if heading is None else heading.finish()
    found = Replay(
        source, Mounting(parameters), first_stamp_ns, updates, estimator.codes, estimator.counters,
        tuple(sorted([*estimator.turns, *under_way], key=lambda turn: turn.start_frame)),
        reliability=estimator.reliability.of_drive, threshold_hint=estimator.threshold_hint,
        way=way, links=estimator.links,
        frame_numbers=None if _UNKNOWN in numbers else numbers,
        unused_speeds=unused_speeds, first_skipped=first_skipped)
    if heading is None:
        return found
    camera = heading.camera
    return replace(
        found, field_of_view=camera.field_of_view, camera=camera.in_use, learned=camera.learned)
