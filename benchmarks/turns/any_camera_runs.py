# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Replays of drives with unknown cameras in all compared ways, and their scores."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
import json
import math
from pathlib import Path
import re
import time

from benchmarks.shared.clips import kitti, on_disk
from benchmarks.shared.report import ROOT
from benchmarks.turns.any_camera_drives import BETWEEN, ride, right_order
import cv2
import numpy as np
from phase_traj_ros.core import (
    CameraEstimate,
    DynamicChainCode,
    HeadingCode,
    Movement,
    PhaseCorrelator,
    TrajectoryEstimator,
    Update,
)
from phase_traj_ros.core.heading.turns import find_turns, Turn
from phase_traj_ros.io.replay.run import Replay, Watcher
from phase_traj_ros.io.sources.base import Candidate, FrameSource, StampedFrame
from phase_traj_ros.io.sources.selection import EVERYTHING
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest
from phase_traj_ros.tasks.evaluation.scores import way_along

#: Thresholds of the paper's state machine, in degrees per second.
THRESHOLDS = (8.0, 12.0, 16.0, 20.0, 25.0)
#: Smallest turn from which the camera has to be learned, in degrees.
_TELLING_DEG = 60.0
#: The angle of a turn is known half a second after its end, and learned a second later.
_LATER_NS = 1_600_000_000
_FOLDER = ROOT / 'out' / 'any_camera'


@dataclass(frozen=True, eq=False)
class Drive:
    """Frames of an unknown camera, and the ground truth."""

    plan: str
    camera: str
    frames: Sequence[np.ndarray]
    stamps_ns: Sequence[int]
    headings: np.ndarray
    """(N,) radians, positive to the left, not wrapped."""
    focal_px: float
    """Pixels per radian in the middle of the image."""
    ways: Sequence[float] | None = None
    """Ways to the frames in heights of the camera; None if they are unknown."""

    @property
    def turns(self) -> list[Turn]:
        """Return the true turns of the least angle that may count, or more."""
        return find_turns(
            self.stamps_ns, self.headings, self.ways, min_angle_deg=BETWEEN[0][0])


@dataclass(frozen=True)
class Focal:
    """What was known of the focal length at some time."""

    error: float
    """Logarithm of the estimate over the truth."""
    half: float
    """Half of the 90 % interval's width, of the logarithm."""

    @property
    def covered(self) -> bool:
        """Return whether the truth is in the interval."""
        return abs(self.error) <= self.half


@dataclass
class Outcome:
    """What came out of one drive."""

    plan: str
    camera: str
    right: str
    """The right codes, a regular expression."""
    turning: int
    """Turns of 60 degrees or more that have ended."""
    reasons: tuple[str, ...]
    """Why the result says that it is not to be relied upon; empty if it says that it is."""
    orders: dict[str, str] = field(default_factory=dict)
    """L and R, by the way they were made."""
    focal: dict[str, Focal | None] = field(default_factory=dict)
    """After the first turn, after three, and at the end; None if nothing was learned."""
    tilt: tuple[float, float] = (0.0, 0.0)
    """Pitch and roll in degrees, as learned."""
    heading_deg: float = 0.0
    """Heading at the end, as measured with two passes."""
    seconds: float = 0.0

    def is_right(self, way: str) -> bool:
        """Return whether one of the ways made the right codes."""
        return re.fullmatch(self.right, self.orders[way]) is not None


def rendered(plan: str, camera: str) -> Drive:
    """Return one of the rendered drives; its frames are kept on the disk."""
    drive, frames = ride(plan, camera)
    model = drive.camera
    kept = on_disk(_file(plan, camera, 'npy'), (len(drive), model.height, model.width), frames)
    return Drive(
        plan, camera, kept, drive.stamps_ns.tolist(), np.unwrap(drive.poses[:, 2]), model.focal,
        (way_along(drive.poses[:, :2]) / model.above_ground).tolist())


def kept(plan: str, camera: str) -> Outcome | None:
    """Return what an earlier run has kept of a drive, if it has."""
    path = _file(plan, camera, 'json')
    if not path.exists():
        return None
    values = json.loads(path.read_text(encoding='utf-8'))
    focal = {
        name: None if known is None else Focal(**known)
        for name, known in values.pop('focal').items()}
    return Outcome(**{
        **values, 'focal': focal, 'tilt': tuple(values['tilt']),
        'reasons': tuple(values['reasons'])})


def keep(outcome: Outcome) -> None:
    """Store the outcome of a drive for a later run that continues this one."""
    path = _file(outcome.plan, outcome.camera, 'json')
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(asdict(outcome), indent=2), encoding='utf-8')


def _file(plan: str, camera: str, suffix: str) -> Path:
    name = re.sub(r'\W+', '_', f'{plan}__{camera}'.replace('°', '').replace('×', 'x'))
    return _FOLDER / f'{name}.{suffix}'


def score(drive: Drive) -> Outcome:
    """Replay a drive in every way."""
    began = time.perf_counter()
    ended = [
        turn for turn in drive.turns
        if abs(turn.angle_deg) >= _TELLING_DEG and turn.end_frame < len(drive.frames) - 1]
    watcher = _Estimates()
    live = _replay(drive, watchers=[watcher], one_pass=True)
    whole = _replay(drive)
    outcome = Outcome(
        drive.plan, drive.camera, right_order(drive.turns, frames=len(drive.frames)), len(ended),
        whole.reliability.words)
    outcome.orders['one pass'] = order(live.movement)
    outcome.orders['auto'] = order(whole.movement)
    for name, after in (('first', 0), ('third', 2)):
        if len(ended) > after:
            known = watcher.at(ended[after].end_ns + _LATER_NS)
            outcome.focal[name] = _compared(known, drive)
    if ended:
        outcome.focal['end'] = _compared(live.learned, drive)
    if live.learned is not None:
        outcome.tilt = (live.learned.pitch_deg, live.learned.roll_deg)
    outcome.orders['heading'] = _quantised(whole.updates)
    outcome.heading_deg = math.degrees(whole.updates[-1].heading.heading)
    assert whole.camera is not None
    for rate, codes in _by_threshold(drive, whole.camera.focal_px):
        outcome.orders[f'{rate:g}°/s'] = codes
    outcome.seconds = time.perf_counter() - began
    return outcome


def order(movement: Iterable[Movement]) -> str:
    """Return the turns of movement codes, L and R."""
    return ''.join(
        'L' if code is Movement.LEFT else 'R' for code in movement
        if code in (Movement.LEFT, Movement.RIGHT))


class _Frames(FrameSource):
    """The frames of a drive, as a source without a calibration."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(
            description=f'{drive.plan}, {drive.camera}', selection=EVERYTHING,
            frame_count=len(drive.frames))
        self._drive = drive

    def _candidates(self) -> Iterator[Candidate]:
        pairs = zip(self._drive.frames, self._drive.stamps_ns)
        for number, (image, stamp_ns) in enumerate(pairs):
            yield Candidate(number, stamp_ns, lambda image=image: np.asarray(image))


class _Estimates(Watcher):
    """Records the estimates of the camera, with their times."""

    def __init__(self) -> None:
        self._learned: list[tuple[int, CameraEstimate]] = []

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        heading = estimator.heading
        learned = None if heading is None else heading.camera.learned
        if learned is not None and (not self._learned or learned != self._learned[-1][1]):
            self._learned.append((frame.stamp_ns, learned))

    def at(self, stamp_ns: int) -> CameraEstimate | None:
        """Return the estimate known at a time; None if there was none."""
        known = [learned for (when, learned) in self._learned if when <= stamp_ns]
        return known[-1] if known else None


def _replay(drive: Drive, *, watchers: Sequence[Watcher] = (), one_pass: bool = False) -> Replay:
    return replay_source(
        _Frames(drive), ReplayRequest(source=Path(drive.plan), one_pass=one_pass),
        watchers=watchers)


def _compared(known: CameraEstimate | None, drive: Drive) -> Focal | None:
    if known is None:
        return None
    least, most = known.focal_interval_px
    return Focal(math.log(known.focal_px / drive.focal_px), math.log(most / least) / 2)


def _quantised(updates: Iterable[Update]) -> str:
    """Return the turns of the heading, quantised to four directions."""
    codes = HeadingCode()
    return order(
        codes.update(update.heading.heading, update.heading.rate).movement
        for update in updates if update.heading is not None)


def _by_threshold(drive: Drive, focal_px: float) -> Iterator[tuple[float, str]]:
    """Yield the turns of the paper's state machine for thresholds that fit the camera."""
    correlator = PhaseCorrelator()
    shifts = [correlator.update(np.asarray(frame)) for frame in drive.frames][1:]
    intervals = np.diff(drive.stamps_ns) * 1e-9
    for rate in THRESHOLDS:
        codes, movement = DynamicChainCode(), []
        for shift, interval in zip(shifts, intervals.tolist()):
            codes.configure(focal_px * math.tan(math.radians(rate * interval)))
            movement.append(codes.update(shift.dx).movement)
        yield rate, order(movement)


def variants(drive: Drive) -> Iterator[Drive]:
    """Yield a drive as it is, and all that is made of it."""
    frames = drive.frames
    height, width = frames[0].shape
    small = (320, round(320 * height / width))
    reduced = [cv2.resize(each, small, interpolation=cv2.INTER_AREA) for each in frames]
    yield replace(drive, camera='as it is')
    yield replace(
        drive, camera='mirrored', frames=[each[:, ::-1].copy() for each in frames],
        headings=-drive.headings)
    yield replace(
        drive, camera='left half', frames=[each[:, :width // 2].copy() for each in frames])
    yield replace(
        drive, camera='upper half', frames=[each[:height // 2].copy() for each in frames])
    yield replace(
        drive, camera='320 px wide', frames=reduced, focal_px=drive.focal_px * 320 / width)
    for every, name in ((2, 'every second frame'), (3, 'every third frame')):
        yield replace(
            drive, camera=name, frames=frames[::every], stamps_ns=drive.stamps_ns[::every],
            headings=drive.headings[::every])


def real(sequence: str) -> Drive | None:
    """Return a clip of KITTI without its calibration; None where it is not at hand."""
    there = kitti(sequence)
    if there is None:
        return None
    camera, frames, poses = there
    return Drive(
        f'KITTI {sequence}', 'as it is', [each.image for each in frames],
        [each.stamp_ns for each in frames], np.unwrap(poses[:, 2]), camera.focal)
