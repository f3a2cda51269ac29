# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws roads, tracks and candidates as SVG; the style sheet of the page has the colours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Candidate, OdometryStep
from phase_traj_ros.tasks.location.run import Located, LocatedPose, UNKNOWN

Points = NDArray[np.float64]

# Least width and height of a view in metres, and its margin as a share of the larger one.
_LEAST_VIEW = 300.0
_MARGIN = 0.12
# Radius of a candidate with the probability 1, and the least radius, as shares of the view.
_CERTAIN = 0.05
_SMALLEST = 0.004


@dataclass(frozen=True, slots=True)
class MapView:
    """A rectangle of the map in metres, drawn with north at the top."""

    west: float
    south: float
    east: float
    north: float

    @classmethod
    def around(cls, points: Points) -> MapView:
        """Return the view of points (N, 2), N at least 1, with a margin."""
        (west, south), (east, north) = points.min(axis=0), points.max(axis=0)
        margin = _MARGIN * max(east - west, north - south)
        wide = max(margin, (_LEAST_VIEW - (east - west)) / 2)
        high = max(margin, (_LEAST_VIEW - (north - south)) / 2)
        return cls(west - wide, south - high, east + wide, north + high)

    @property
    def size(self) -> float:
        """Return the larger side in metres."""
        return max(self.east - self.west, self.north - self.south)

    def svg(self, roads: Iterable[Points], content: str, *, label: str) -> str:
        """
        Return the drawing of SVG elements on roads, polylines (N, 2), with a scale bar.

        ``label`` is its accessible name. Roads outside the view are left out.
        """
        box = f'0 0 {self.east - self.west:.1f} {self.north - self.south:.1f}'
        seen = (
            self._path(line) for line in roads
            if line[:, 0].max() >= self.west and line[:, 0].min() <= self.east
            and line[:, 1].max() >= self.south and line[:, 1].min() <= self.north)
        return (
            f'<svg class="roadmap" viewBox="{box}" role="img" aria-label="{label}">'
            f'<path class="roads" d="{"".join(seen)}"/>{content}{self._scale_bar()}</svg>')

    def line(self, points: Points, kind: str) -> str:
        """Return a polyline through points (N, 2); ``kind`` is its class in the style sheet."""
        return f'<path class="{kind}" d="{self._path(points)}"/>'

    def _path(self, points: Points) -> str:
        """Return a polyline (N, 2) as the data of an SVG path, rounded to decimetres."""
        return 'M' + 'L'.join(
            f'{x - self.west:.1f} {self.north - y:.1f}' for x, y in points.tolist())

    def dot(self, point: Iterable[float], kind: str, *, radius: float, hint: str) -> str:
        """Return a dot with a tooltip; ``radius`` is a share of the view."""
        x, y = point
        return (
            f'<circle class="{kind}" cx="{x - self.west:.1f}" cy="{self.north - y:.1f}"'
            f' r="{radius * self.size:.1f}"><title>{hint}</title></circle>')

    def candidates(self, candidates: Sequence[Candidate]) -> str:
        """Return dots whose areas are proportional to the probabilities."""
        return ''.join(
            self.dot(
                (each.x, each.y), 'candidate', hint=f'{each.probability:.3f}',
                radius=max(_CERTAIN * math.sqrt(each.probability), _SMALLEST))
            for each in candidates)

    def _scale_bar(self) -> str:
        """Return a scale bar of a round length, with a label."""
        wanted = self.size / 5
        power = 10 ** math.floor(math.log10(wanted))
        length = max(factor * power for factor in (1, 2, 5) if factor * power <= wanted)
        left, top = 0.03 * self.size, self.north - self.south - 0.03 * self.size
        text = f'{length:g} m' if length < 1000 else f'{length / 1000:g} km'
        return (
            f'<path class="bar" d="M{left:.1f} {top:.1f}h{length:.1f}"/>'
            f'<text x="{left:.1f}" y="{top - 0.012 * self.size:.1f}"'
            f' font-size="{0.03 * self.size:.1f}">{text}</text>')


def draw_track(located: Located) -> str:
    """
    Return the roads and the track, including the part before the first claim, as SVG.

    Without a claim, the candidates at the end replace the track.
    """
    tracks = [
        np.array([(pose.estimate.x, pose.estimate.y) for pose in track])
        for track in located.tracks]
    before = track_before(located)
    view = MapView.around(np.concatenate([*tracks, before]) if tracks else located.roads.nodes)
    if tracks:
        content = ''.join([
            view.line(before, 'before'), *(view.line(track, 'track') for track in tracks),
            view.dot(tracks[0][0], 'first', radius=0.012, hint='known from here'),
            view.dot(tracks[-1][-1], 'last', radius=0.012, hint='end')])
    else:
        content = view.candidates(located.poses[-1].estimate.candidates)
    return view.svg(located.roads.lines, content, label='Roads and track')


def draw_candidates(located: Located, pose: LocatedPose) -> str:
    """Return the whole map and the candidates at a pose as SVG."""
    view = MapView.around(located.roads.nodes)
    return view.svg(
        located.roads.lines, view.candidates(pose.estimate.candidates), label='Candidates')


def moments_before(located: Located) -> list[LocatedPose]:
    """Return at most four poses at equal distances up to the first claim, or to the end."""
    first = located.first_claim
    end = located.poses[-1].driven if first is None else first.driven
    estimated = [
        pose for pose in located.poses if pose.estimate is not UNKNOWN and pose.driven <= end]
    if not estimated:
        return []
    wanted = [end * quarter / 4 for quarter in range(1, 5)]
    found = [min(estimated, key=lambda pose: abs(pose.driven - at)) for at in wanted]
    return list({pose.stamp_ns: pose for pose in found}.values())


def track_before(located: Located) -> Points:
    """
    Return the track up to the first claim, by dead reckoning backwards from it, (N, 2) in metres.

    It begins at the start, or at the last interruption before the claim. It is empty without a
    claim.
    """
    first = located.first_claim
    if first is None:
        return np.zeros((0, 2))
    claim = first.estimate
    x, y, heading = claim.x, claim.y, claim.heading
    points = [(x, y)]
    motions = located.odometry.motions[:located.poses.index(first)]
    for motion in reversed(list(chain.from_iterable(motions))):
        if not isinstance(motion, OdometryStep):
            break
        middle = heading - motion.yaw / 2
        x -= claim.scale * motion.distance * math.cos(middle)
        y -= claim.scale * motion.distance * math.sin(middle)
        heading -= motion.yaw
        points.append((x, y))
    return np.array(points[::-1])
