# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Draw the picture of docs/explanation/locate.md: the candidates at four moments of a drive.

The drive and its town are those of ``phase_traj demo --map``; the odometry is the truth with drawn
noise. The same noise always gives the same file.
"""

from itertools import pairwise
from pathlib import Path
import tempfile

from matplotlib.figure import Figure
import numpy as np
from phase_traj_ros.core.localization.given import OdometryStep
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
from phase_traj_ros.io.results.palette import LIGHT
from phase_traj_ros.synthetic import Drive, town_drive
from phase_traj_ros.tasks.location.drawing import moments_before
from phase_traj_ros.tasks.location.odometry import DriveOdometry, IN_METRES
from phase_traj_ros.tasks.location.run import locate, Located

PICTURE = (
    Path(__file__).resolve().parent.parent / 'docs' / 'images' / 'locate_candidates.png')
ORIGIN = LocalProjection(54.5, 7.0)
#: Noise of the odometry: metres and radians per step of about 0.8 m, and an error of the scale.
DISTANCE_NOISE, YAW_NOISE, SCALE = 0.02, 0.002, 1.02


def main() -> None:
    """Locate the drive, and write the picture."""
    drive = town_drive()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'town.osm'
        write_osm(drive.build_roads(), path, projection=ORIGIN)
        located = locate(odometry(drive), read_roads(path))
    draw(located, drive).savefig(PICTURE, dpi=150)
    print(f'written to {PICTURE}')


def odometry(drive: Drive) -> DriveOdometry:
    """Return the odometry of a drive, with noise."""
    rng = np.random.default_rng(1)
    motions = []
    for number, (before, after) in enumerate(pairwise(drive.poses[:, :3].tolist()), 1):
        true = OdometryStep.between(before, after, stamp_ns=int(drive.stamps_ns[number]))
        motions.append((OdometryStep(
            stamp_ns=true.stamp_ns,
            distance=SCALE * true.distance + DISTANCE_NOISE * rng.standard_normal(),
            yaw=true.yaw + YAW_NOISE * rng.standard_normal()),))
    return DriveOdometry('town', tuple(drive.stamps_ns.tolist()), tuple(motions), IN_METRES)


def draw(located: Located, drive: Drive) -> Figure:
    """Return the candidates at four moments up to the first claim, and the true places."""
    figure = Figure(figsize=(7.2, 6.4), layout='constrained')
    degrees = ORIGIN.to_degrees(*drive.poses[:, :2].T)
    truth = dict(zip(
        drive.stamps_ns.tolist(), located.roads.projection.to_metres(*degrees).tolist()))
    for plot, pose in zip(figure.subplots(2, 2).flat, moments_before(located)):
        for line in located.roads.lines:
            plot.plot(*line.T, color=LIGHT.muted, linewidth=0.8)
        candidates = pose.estimate.candidates
        plot.scatter(
            [each.x for each in candidates], [each.y for each in candidates],
            s=[300 * each.probability + 6 for each in candidates], color=LIGHT.accent, alpha=0.7,
            linewidths=0)
        plot.plot(*truth[pose.stamp_ns], '+', color=LIGHT.ink, markersize=14)
        known = 'known' if pose.estimate.claimed else 'not known'
        plot.set_title(
            f'after {pose.driven:.0f} m: {known}, probability {pose.estimate.probability:.2f}',
            fontsize='small', loc='left')
        plot.set_aspect('equal')
        plot.set_axis_off()
    return figure


if __name__ == '__main__':
    main()
