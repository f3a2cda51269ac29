# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The same drives at other frame rates and speeds, with repeated and lost frames, and jitter.

Writes docs/measurements/frame_rate.md. Results are kept in out/frame_rate, so a stopped run
continues, and a complete one only writes the page. ``--only TEXT`` measures those whose name
contains the text (again), and writes no page; ``--again`` measures all of them anew.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict, dataclass
import json
import math
from pathlib import Path
import re
import time

from benchmarks.distance.drives import FoundPath
from benchmarks.distance.frame_rate_drives import DRIVES, FILMED, Filmed, Material
from benchmarks.shared.clips import at_axle, KITTI_LEVER_M, model_of
from benchmarks.shared.report import all_met, machine, paragraphs, ROOT, table, write_page
from benchmarks.shared.timing import prepare
import cv2
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.core.heading.tuning import TUNING
from phase_traj_ros.core.heading.turns import find_turns
from phase_traj_ros.synthetic import Drive
from phase_traj_ros.tasks.evaluation.scores import way_along

_KEPT = ROOT / 'out' / 'frame_rate'
_MOST_DISTANCE, _MOST_HEADING_DEG, _MOST_DRIFT = 0.015, 0.5, 0.25
# Two-sided 95 % of a chi-square distribution with three degrees of freedom; errors of the height,
# the mounting and the scale of all angles, as the estimator expects them.
_BAND = (0.22, 9.35)
_HEIGHT, _MOUNTED, _ANGLES = 0.04, math.radians(0.5), 0.01
# Poses that count for the variances: from here on, in heights of the camera; how many of them; and
# how often the errors are drawn.
_FROM, _POSES, _DRAWS = 5.0, 60, 1000

_INTRODUCTION = f"""
    This page shows whether the result depends on the frame rate.

    From 5 to 120 Hz, with repeated and lost frames and with late stamps, turns and codes are the
    same, and nearly all distances and headings are within the limits below. The exceptions are a
    motorway at 5 Hz, where the road moves too far between two frames, and the night.

    Every drive is rendered once at 120 Hz, with the noise of a sensor (once that of a night with 6
    % of the light), and sampled in several ways: at lower rates, with repeated pictures (a film of
    15, 10 or 24 Hz converted to 30 Hz), with a fifth of the frames lost at random, with stamps
    that are off by a tenth of the interval, or with a third of the frames, at random, stamped up
    to 0.7 of the interval late, as they arrive. The result should be the same. The calibration of
    the camera and its height are given.

    *Distance* is the error of the total distance, *heading* the largest error of the heading. They
    should be within {100 * _MOST_DISTANCE:.1f} % and within {_MOST_HEADING_DEG}° or
    {_MOST_DRIFT}° per 100 m, whichever is more. *Turns* are the signed numbers of quarter turns
    (left is positive), *codes* the movement codes that turn (L, R). *NEES* is the share of poses
    whose normalised squared error of x, y and yaw lies between {_BAND[0]} and {_BAND[1]}, with the
    errors of the given height, of the mounting and of the calibration drawn {_DRAWS} times from
    what the estimator expects; it should be 95 %. Along KITTI 00, the mounting is that of its
    poses, 1° aside in these 15 s, and the true path is that of the rear axle, {KITTI_LEVER_M} m
    behind the camera. *In doubt* is the share of the drive that the result
    itself calls unreliable, and why.
    """


@dataclass(frozen=True)
class Row:
    """Results of one drive, filmed in one way; distances in metres, angles in degrees."""

    drive: str
    filmed: str
    metres: float
    distance: float
    heading_deg: float
    turns: list[int]
    codes: str
    right: list[int]
    nees: tuple[float, float] | None
    """Shares of the poses within the band and below it; None if none has a position."""
    words: list[str]
    doubted: float
    ms: float

    @property
    def name(self) -> str:
        """Return the name of the drive and of the way in which it was filmed."""
        return f'{self.drive}: {self.filmed}'

    @property
    def most_heading_deg(self) -> float:
        """Return the largest error of the heading that is allowed."""
        return max(_MOST_HEADING_DEG, _MOST_DRIFT * self.metres / 100)

    @property
    def within(self) -> bool:
        """Return whether the result is as it should be, apart from its variances."""
        codes = [1 if code == 'L' else -1 for code in self.codes]
        quarters = [int(math.copysign(1, turn)) for turn in self.right for _ in range(abs(turn))]
        return (abs(self.distance) <= _MOST_DISTANCE
                and self.heading_deg <= self.most_heading_deg
                and self.turns == self.right and codes == quarters)


def main() -> None:
    """Measure what was asked for, and write the page if that is all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--only', metavar='TEXT')
    parser.add_argument('--again', action='store_true')
    chosen = parser.parse_args()
    prepare()
    cv2.setRNGSeed(0)
    rows = []
    for drive in DRIVES:
        asked = [filmed for filmed in FILMED if (chosen.only or '') in f'{drive}: {filmed}']
        rows += measured(drive, asked, again=chosen.again or chosen.only is not None)
    if chosen.only is None:
        write_page('frame_rate', page(rows))
    else:
        print(_table(rows, 'name'))
        print('processor time per frame:', ', '.join(f'{row.ms:.1f} ms' for row in rows))


def measured(drive: str, asked: list[str], *, again: bool) -> Iterator[Row]:
    """Yield the rows of a drive; those that have been measured are not measured again."""
    material = None
    for filmed in asked:
        file = _file(drive, filmed)
        if again or not file.exists():
            material = material or Material(drive, _KEPT / 'frames')
            row = follow(material, filmed)
            print(f'{row.name}: {100 * row.distance:+.1f} %, {row.heading_deg:.2f}°, {row.turns}',
                  flush=True)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(asdict(row)), encoding='utf-8')
        yield Row(**json.loads(file.read_text(encoding='utf-8')))


def _file(drive: str, filmed: str) -> Path:
    return _KEPT / (re.sub(r'\W+', '-', f'{drive}-{filmed}') + '.json')


def follow(material: Material, name: str) -> Row:
    """Follow a drive filmed in one way, and return its errors."""
    drive = material.drive
    filmed: Filmed = FILMED[name](len(drive))
    above = drive.camera.above_ground
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(camera=model_of(drive.camera)), code_source=CodeSource.AUTO,
        camera_height=above, camera_height_deviation=_HEIGHT))
    path, codes, heading, seconds = FoundPath(), '', [0.0], 0.0
    for frame, stamp_ns in zip(material.frames(filmed), filmed.stamps_ns.tolist()):
        began = time.process_time()
        update = estimator.update(frame, stamp_ns)
        seconds += time.process_time() - began
        if update is None:
            continue
        assert update.heading is not None
        codes += {0: 'L', 2: 'R'}.get(int(update.step.movement), '')
        heading.append(update.heading.heading)
        path.add(update.odometry)
    assert estimator.heading is not None
    turns = sorted(
        [*estimator.turns, *estimator.heading.finish()], key=lambda turn: turn.start_frame)
    true = drive.poses[filmed.exposures][:, :3]
    yaw = np.unwrap(true[:, 2]) - true[0, 2]
    metres = float(way_along(true[:, :2])[-1])
    found = estimator.reliability.of_drive
    lasted = max(found.end_ns - found.start_ns, 1)
    doubted = sum(span.end_ns - span.start_ns for span in found.spans) / lasted
    along_kitti = 'KITTI' in drive.name
    return Row(
        drive.name, name, metres, (estimator.way.distance or 0.0) / metres - 1.0,
        float(np.degrees(np.abs(np.array(heading) - yaw).max())),
        [turn.quarter_turns for turn in turns], codes,
        _quarters(drive),
        _nees(*path.arrays(), at_axle(true, KITTI_LEVER_M) if along_kitti else true, above,
              mounted=0.0 if along_kitti else _MOUNTED),
        list(found.words), min(doubted, 1.0), 1e3 * seconds / len(heading))


def _quarters(drive: Drive) -> list[int]:
    """Return the true turns of 60 degrees or more, each as a signed number of quarter turns."""
    if drive.turns:
        angles = [turn.angle_deg for turn in drive.turns]
        return [round(angle / 90) for angle in angles if abs(angle) >= TUNING.turn_deg]
    found = find_turns(drive.stamps_ns.tolist(), np.unwrap(drive.poses[:, 2]))
    return [turn.quarter_turns for turn in found]


def perturbed(true: np.ndarray, askew: float, scale: float) -> np.ndarray:
    """
    Return the path, (N, 3), as a camera finds it that is mounted and calibrated a little wrong.

    ``askew`` is the yaw of its mounting in radians, ``scale`` the relative error of all angles.
    """
    moved = np.diff(true[:, :2], axis=0)
    yaw = np.unwrap(true[:, 2]) - true[0, 2]
    middle = (yaw[1:] + yaw[:-1]) / 2
    cosine, sine = np.cos(true[0, 2] + middle), np.sin(true[0, 2] + middle)
    along = moved[:, 0] * cosine + moved[:, 1] * sine
    across = moved[:, 1] * cosine - moved[:, 0] * sine
    way = np.copysign(np.hypot(along, across), along)
    off = np.arctan2(np.sign(along) * across, np.abs(along))
    ahead = (1.0 + scale) * middle + off - askew
    steps = np.stack([way * np.cos(ahead), way * np.sin(ahead)], axis=1)
    return np.column_stack([
        np.concatenate([[(0.0, 0.0)], np.cumsum(steps, axis=0)]), (1.0 + scale) * yaw])


def _nees(
    found: np.ndarray, covariances: np.ndarray, true: np.ndarray, above: float, *, mounted: float,
) -> tuple[float, float] | None:
    """
    Return ``Row.nees`` of some poses, with what a drive has once drawn often.

    One drawn height or mounting makes all poses of a drive right or wrong alike.
    """
    way = way_along(true[:, :2])
    chosen = np.flatnonzero((way >= _FROM * above) & np.isfinite(covariances).all(axis=(1, 2)))
    if not len(chosen):
        return None
    chosen = chosen[np.linspace(0, len(chosen) - 1, _POSES).astype(int)]
    values: list[float] = []
    for off, askew, scale in np.random.default_rng(1).normal(size=(_DRAWS, 3)):
        # The way and its covariance are in heights of the camera, as they are given.
        unit = np.array([1.0 + _HEIGHT * off, 1.0 + _HEIGHT * off, 1.0])
        errors = (found * unit - perturbed(true, mounted * askew, _ANGLES * scale))[chosen]
        assumed = covariances[chosen] * np.outer(unit, unit)
        solved = np.linalg.solve(assumed, errors[:, :, None])[:, :, 0]
        values += (errors * solved).sum(axis=1).tolist()
    low, high = _BAND
    below = sum(value <= low for value in values) / len(values)
    return sum(low < value < high for value in values) / len(values), below


def page(rows: list[Row]) -> Iterator[str]:
    """Yield the parts of the page."""
    yield '# Frame rates'
    yield paragraphs(_INTRODUCTION)
    yield 'Written by `benchmarks/distance/frame_rate.py` (`make frame-rate`).'
    right = sum(row.within for row in rows)
    told = sum(not row.within and row.doubted >= 0.005 for row in rows)
    yield paragraphs(f"""
        {right} of {len(rows)} are within the limits; of the others, {told} say at least in part
        that they are in doubt. Of all poses, {_inside(rows)} lie within the band. The errors of
        {_below(rows)} are smaller than that, as the variances are those of real drives.
        """)
    for drive in DRIVES:
        those = [row for row in rows if row.drive == drive]
        yield f'## {drive[0].upper()}{drive[1:]}'
        yield paragraphs(f"""
            {those[0].metres:.0f} m, quarter turns: {_signed(those[0].right)}; of the poses,
            {_inside(those)} lie within the band. {_times(those)}
            """)
        yield _table(those)
    yield '## Measured on'
    yield machine()


def _table(rows: list[Row], first: str = 'filmed') -> str:
    return table(
        (first, 'distance', 'heading', 'turns', 'codes', 'NEES', 'in doubt', 'within the limits'),
        [(getattr(row, first), f'{100 * row.distance:+.1f} %', f'{row.heading_deg:.2f}°',
          _signed(row.turns), row.codes or '–', _inside([row]),
          f'{100 * row.doubted:.0f} % {" ".join(f"`{word}`" for word in row.words)}'.strip(),
          all_met(row.within)) for row in rows])


def _times(rows: list[Row]) -> str:
    ms = {row.filmed: row.ms for row in rows}
    shares = [
        f'{ms[rate] / ms["10 Hz"]:.2f} at {rate}' for rate in ('30 Hz', '60 Hz', '120 Hz')]
    return f'Processor time of a frame, beside that at 10 Hz: {", ".join(shares)}.'


def _signed(turns: list[int]) -> str:
    return ' '.join(f'{turn:+d}' for turn in turns) or '–'


def _inside(rows: list[Row]) -> str:
    shares = [row.nees[0] for row in rows if row.nees is not None]
    return f'{100 * np.mean(shares):.0f} %' if shares else ''


def _below(rows: list[Row]) -> str:
    return f'{100 * np.mean([row.nees[1] for row in rows if row.nees is not None]):.0f} %'


if __name__ == '__main__':
    main()
