# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Record this package's own odometry along rendered KITTI sequences, for locate.py.

Takes minutes a sequence. ``odometry.py OUTPUT 00 02`` writes OUTPUT/00.npz and so on; what
exists is kept. ``00-learned`` is sequence 00 with an unknown camera, learned in a first pass as by
a replay. A file holds a row per pair of frames.
"""

from __future__ import annotations

from pathlib import Path
import sys
import zlib

from benchmarks.distance import drives
from benchmarks.shared.clips import model_of
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.io.replay.camera import learned_lens
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters

_HEIGHT, _DEVIATION = 1.65, 0.04


def record(sequence: str, file: Path) -> None:
    """Follow the drive along a sequence with the height of its camera 4 % wrong (1 sigma)."""
    number, _, camera = sequence.partition('-')
    ride = drives.along_kitti(number)
    lens = Lens(camera=model_of(ride.camera)) if not camera else learned_lens(
        map(StampedFrame, ride.frames(), ride.stamps_ns), Parameters(), ride.name)
    if lens is None:
        raise SystemExit(f'{sequence}: no turn of this drive tells the camera')
    height = _HEIGHT * (1.0 + _DEVIATION * np.random.default_rng(
        zlib.crc32(ride.name.encode())).normal())
    estimator = TrajectoryEstimator(EstimatorSettings(
        lens=lens, code_source=CodeSource.AUTO, camera_height=height))
    rows = []
    for frame, stamp_ns in zip(ride.frames(), ride.stamps_ns):
        update = estimator.update(frame, stamp_ns)
        if update is None:
            continue
        travel, step = update.travel, update.heading
        assert travel is not None and step is not None
        rows.append((
            travel.distance, travel.variance, travel.swing, travel.tilt, travel.scale,
            step.yaw, step.variance))
        if len(rows) % 500 == 0:
            print(sequence, len(rows), flush=True)
    np.savez_compressed(
        file, stamps_ns=np.array(ride.stamps_ns[:len(rows) + 1]), rows=np.array(rows),
        height=height)


def main() -> None:
    """Record the sequences that the command line names."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for sequence in sys.argv[2:]:
        file = folder / f'{sequence}.npz'
        if not file.exists():
            record(sequence, file)


if __name__ == '__main__':
    main()
