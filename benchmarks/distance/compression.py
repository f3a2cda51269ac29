# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Accuracy of distances in compressed films.

Writes docs/measurements/compression.md in about five minutes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import av
from benchmarks.distance import drives
from benchmarks.heading.drives import real_rides, Ride
from benchmarks.shared.clips import model_of
from benchmarks.shared.report import paragraphs, table, versions, write_page
import cv2
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.synthetic import Camera
from phase_traj_ros.synthetic.degradations import encoded
from phase_traj_ros.tasks.evaluation.scores import way_along

_RATE_FACTORS = (23, 28, 33, 38)

_INTRODUCTION = """
    This page shows how the compression of a video affects the
    [distance](../explanation/distance.md). The encoder copies most of the road from frame to
    frame.

    Up to a factor of 28, the distance changes by about 1 % or less, in one clip of half size by 3
    %. With stronger compression, it mostly becomes too short; every distance that is off by
    more than 6 % is reported as unreliable.

    The frames of real clips and of rendered drives are encoded with x264 at several constant rate
    factors (23 is its default), in full size and in half of it. The calibration of the camera and
    its height are given. The numbers are errors of the total distance; the words are those of
    its reliability.

    Written by `benchmarks/distance/compression.py` with {versions}, PyAV {av}.
    """


def main() -> None:
    """Measure all films, and write the page."""
    rows = []
    for ride in rides():
        for shrunk in (ride, half(ride)):
            rows.append((
                ride.name, f'{shrunk.camera.width}×{shrunk.camera.height}',
                followed(shrunk, list(shrunk.frames())), *films(shrunk)))
            print(*rows[-1], sep='  ', flush=True)
    introduction = _INTRODUCTION.format(versions=versions(), av=av.__version__)
    header = ('drive', 'size', 'not compressed', *map(str, _RATE_FACTORS))
    write_page('compression', (
        '# Compressed videos', paragraphs(introduction), table(header, map(_cells, rows))))


def rides() -> Iterator[Ride]:
    """Yield the drives."""
    # Without the mirrored ones.
    yield from real_rides()[::2]
    yield drives.motorway(25.0).kept()
    yield drives.block().kept()


def half(ride: Ride) -> Ride:
    """Return a ride in pictures of half the size."""
    camera = ride.camera
    sides = camera.width // 2, camera.height // 2
    smaller = Camera(
        *sides, camera.focal / 2, (camera.cx - 0.5) / 2, (camera.cy - 0.5) / 2)
    return replace(ride, camera=smaller, frames=lambda: (
        cv2.resize(frame[:2 * sides[1], :2 * sides[0]], sides, interpolation=cv2.INTER_AREA)
        for frame in ride.frames()))


def films(ride: Ride) -> Iterator[tuple[float, str]]:
    """Yield the result of the film at each rate factor."""
    frames = list(ride.frames())
    for factor in _RATE_FACTORS:
        yield followed(ride, encoded(frames, rate_factor=factor))


def followed(ride: Ride, frames: list[np.ndarray]) -> tuple[float, str]:
    """Return the relative error of the distance, and the reasons against it."""
    height, width = frames[0].shape
    camera = replace(model_of(ride.camera), width=width, height=height)
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=Lens(camera=camera), code_source=CodeSource.AUTO, camera_height=1.65))
    for frame, stamp_ns in zip(frames, ride.stamps_ns):
        estimator.update(frame, stamp_ns)
    way = way_along(drives.true_path(ride)[:, :2])[-1]
    return (estimator.way.distance or 0.0) / way - 1.0, ', '.join(estimator.reliability.words)


def _cells(row: tuple) -> tuple[str, ...]:
    name, size, *results = row
    return name, size, *(
        f'{100 * error:+.1f} %' + (f', `{words}`' if words else '') for error, words in results)


if __name__ == '__main__':
    main()
