# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Lorries that cross close in front of a standing vehicle, which then turns.

Writes docs/measurements/cross_traffic.md in about ten minutes. With ``code_source: heading``, no
lorry is recognised, so its errors are those without the rule.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
import math

from benchmarks.shared.clips import paste
from benchmarks.shared.report import paragraphs, table, versions, write_page
import cv2
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.synthetic import Camera, Drive, plan_drive, render_drive, Straight, Turn

_RATES_HZ = (5, 10, 30)
_CAMERA = Camera.with_field_of_view(480, 270, 70.0)
_DRIVING_S, _STANDING_S, _TURNING_S = 3.0, 14.0, 5.0
_LORRIES = 24
_NOISE = 1.5
_WRONG_DEG = 2.0

_INTRODUCTION = """
    This page shows what lorries that cross close in front of a standing vehicle do to the heading.

    With `auto`, the lorry turns the heading in one of the drives at 5 Hz, and in none at 10 and 30
    Hz. Where traffic is not recognised, it does so in a third to two thirds of them. The turn
    after the lorry is measured correctly in all.

    The camera ({width}×{height} px, {hfov:.0f}°, known) drives along a rendered street at 8 m/s,
    stands for {standing:.0f} s, and leaves with a turn of 90°. While it stands, a lorry crosses:
    a textured board that covers 30 to 75 % of the height and 40 to 160 % of the width of the
    picture, within 2 to 10 s, from either side. The sensor has noise. There are {lorries} random
    lorries; half of the turns go left. A heading is *off* if it is wrong by more than
    {wrong:g}° after the lorry, or by more than 5 % after the turn. The codes of
    `code_source: heading` come from the same blocks, but do not
    [recognise traffic](../explanation/trust.md#traffic-in-front-of-a-standing-vehicle). A drive is
    *unreliable* if the package reports it as such.

    Written by `benchmarks/heading/cross_traffic.py` with {versions}.
    """


@dataclass(frozen=True)
class Lorry:
    """A textured board that crosses the picture; lengths are shares of the picture's."""

    seed: int
    width: float
    height: float
    top: float
    begins_s: float
    lasts_s: float
    to_right: bool

    def cover(self, frame: np.ndarray, seconds: float) -> None:
        """Draw the board into a frame, ``seconds`` after the vehicle has stopped."""
        rows, columns = frame.shape
        length = round(self.width * columns)
        way = round((columns + length) * (seconds - self.begins_s) / self.lasts_s)
        if 0.0 <= seconds - self.begins_s <= self.lasts_s:
            paste(frame, _board(self.seed, round(self.height * rows), length),
                  round(self.top * rows), way - length if self.to_right else columns - way)


@cache
def _board(seed: int, height: int, length: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    grain = cv2.GaussianBlur(
        rng.integers(0, 256, (height, length)).astype(np.uint8), (0, 0), rng.uniform(1.0, 6.0))
    contrast = rng.uniform(60.0, 255.0)
    return np.asarray(cv2.normalize(grain, None, 0, contrast, cv2.NORM_MINMAX), np.uint8)


def lorries() -> Iterator[Lorry]:
    """Yield the lorries."""
    rng = np.random.default_rng(11)
    for seed in range(_LORRIES):
        height = rng.uniform(0.3, 0.75)
        yield Lorry(
            seed, rng.uniform(0.4, 1.6), height, rng.uniform(0.0, 0.9 - height),
            rng.uniform(0.5, 3.0), rng.uniform(2.0, 10.0), bool(rng.integers(2)))


@cache
def driven(rate_hz: int, angle_deg: float) -> tuple[Drive, Sequence[np.ndarray]]:
    """Return the drive without a lorry, and its frames."""
    drive = plan_drive(
        'a junction', [Straight(_DRIVING_S), Straight(_STANDING_S, 0.0),
                       Turn(angle_deg, _TURNING_S, 5.0), Straight(1.0)],
        rate_hz=rate_hz, speed=8.0, camera=_CAMERA, seed=29)
    return drive, list(render_drive(drive))


def errors(rate_hz: int, lorry: Lorry, source: CodeSource) -> tuple[float, float, bool]:
    """
    Return what a lorry does to the heading.

    These are the errors by the lorry and by the turn after it, in degrees, and whether the drive
    is reported as unreliable.
    """
    drive, frames = driven(rate_hz, 90.0 if lorry.seed % 2 else -90.0)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=source, lens=Lens(focal_px=_CAMERA.focal)))
    rng = np.random.default_rng(lorry.seed)
    headings = [0.0]
    for number, (frame, stamp_ns) in enumerate(zip(frames, drive.stamps_ns.tolist())):
        noisy = frame.copy()
        lorry.cover(noisy, number / rate_hz - _DRIVING_S)
        noisy = np.clip(noisy + rng.normal(0.0, _NOISE, frame.shape), 0, 255).astype(np.uint8)
        update = estimator.update(noisy, stamp_ns)
        if update is not None:
            assert update.heading is not None
            headings.append(math.degrees(update.heading.heading))
    true = np.degrees(np.unwrap(drive.poses[:, 2]))
    off = np.array(headings) - (true - true[0])
    stops, leaves = (
        round(seconds * rate_hz) for seconds in (_DRIVING_S, _DRIVING_S + _STANDING_S))
    return (float(off[leaves] - off[stops]), float(off[-1] - off[leaves]),
            not estimator.reliability.of_drive.reliable)


def page() -> Iterator[str]:
    """Yield the parts of the page."""
    yield '# Traffic in front of a standing vehicle'
    yield paragraphs(_INTRODUCTION.format(
        width=_CAMERA.width, height=_CAMERA.height, hfov=70.0, standing=_STANDING_S,
        lorries=_LORRIES, wrong=_WRONG_DEG, versions=versions()))
    rows = []
    for rate_hz in _RATES_HZ:
        for source in (CodeSource.AUTO, CodeSource.HEADING):
            found = np.abs([errors(rate_hz, lorry, source) for lorry in lorries()])
            rows.append((
                f'{rate_hz} Hz', f'`{source.value}`',
                *(f'{np.count_nonzero(each > limit)} of {_LORRIES}; {each.max():.1f}°'
                  for each, limit in zip(found.T, (_WRONG_DEG, 4.5))),
                f'{np.count_nonzero(found[:, 2])} of {_LORRIES}'))
            print(*rows[-1], flush=True)
    yield table(
        ('frame rate', '`code_source`', 'off after the lorry; worst', 'off after the turn; worst',
         'unreliable'), rows)


def main() -> None:
    """Measure, and write the page."""
    cv2.setNumThreads(1)
    write_page('cross_traffic', page())


if __name__ == '__main__':
    main()
