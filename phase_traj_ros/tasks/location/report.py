# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the report of a located drive as a self-contained HTML file."""

from pathlib import Path

import phase_traj_ros
from phase_traj_ros.io.maps.projection import bearing_deg
from phase_traj_ros.io.maps.road_file import ATTRIBUTION
from phase_traj_ros.io.results.report.page import filled, Markup, template, write_page
from phase_traj_ros.tasks.location.drawing import draw_candidates, draw_track, moments_before
from phase_traj_ros.tasks.location.run import Located

# The curve of the probability has fewer than twice this many points.
_MOST_POINTS = 1500


def write_location_report(located: Located, path: Path, *, title: str) -> None:
    """
    Write the report.

    Parameters
    ----------
    located
        The drive.
    path
        The file to write.
    title
        Heading of the report, such as the name of the source.

    """
    known = located.first_claim is not None
    content = filled(template('location.html'), {
        'headline': verdict(located),
        'track': Markup(draw_track(located)),
        'legend': (
            'Grey: roads. Blue: the track from where the place is known. Red and dotted: the track'
            ' before that, computed backwards from there.' if known else
            'Grey: roads. Red: the candidates at the end.'),
        'probability': Markup(_curve(located)),
        'when': 'before the place is known' if known else 'along the drive',
        'candidates': Markup(''.join(
            f'<figure><figcaption>after {pose.driven * located.scale.middle:.0f} m</figcaption>'
            f'{draw_candidates(located, pose)}</figure>' for pose in moments_before(located))),
        'attribution': ATTRIBUTION,
        'version': phase_traj_ros.__version__,
    })
    write_page(
        path, title=title, source=f'{located.odometry.source} on {located.roads.source}',
        facts=_facts(located), content=content)


def verdict(located: Located) -> str:
    """Return a sentence that says whether the place is known, and since when."""
    first = located.first_claim
    if first is None:
        return 'The place is not known'
    seconds = (first.stamp_ns - located.poses[0].stamp_ns) * 1e-9
    return (
        f'The place is known after {first.driven * first.estimate.scale:.0f} m ({seconds:.0f} s)')


def _facts(located: Located) -> list[tuple[str, str]]:
    last = located.poses[-1].estimate
    near = located.near
    facts = [
        ('km of road', f'{located.roads.length / 1e3:.0f}'),
        ('start', 'anywhere on the map' if near is None else
         f'within {near.radius:g} m of {near.latitude:g}, {near.longitude:g}'),
        ('metres per unit', f'{located.scale.least:g} to {located.scale.most:g}'),
        ('level', f'{located.level:g}'),
        ('probability at the end', f'{last.probability:.3f}'),
    ]
    if last.claimed:
        latitude, longitude = located.degrees(last)
        facts += [
            ('at the end', f'{latitude:.5f}, {longitude:.5f}'),
            ('bearing at the end', f'{bearing_deg(last.heading):.0f}°'),
            ('standard deviation, m', f'{last.standard_deviation:.1f}')]
    return facts


def _curve(located: Located) -> str:
    """Return the curve of the probability over the distance as SVG."""
    sampled = located.poses[::max(len(located.poses) // _MOST_POINTS, 1)]
    width = max(located.poses[-1].driven, 1e-6)
    points = 'L'.join(
        f'{100 * pose.driven / width:.2f} {100 - 100 * pose.estimate.probability:.2f}'
        for pose in sampled)
    first = located.first_claim
    claim = '' if first is None else (
        f'<path class="claim" d="M{100 * first.driven / width:.2f} 0V100"/>')
    return (
        '<svg class="curve" viewBox="0 -2 100 104" preserveAspectRatio="none" role="img"'
        ' aria-label="Probability over the distance">'
        f'<path class="level" d="M0 {100 - 100 * located.level:.2f}H100"/>{claim}'
        f'<path d="M{points}"/></svg>')
