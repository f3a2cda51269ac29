# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes where a drive went, as CSV, GeoJSON, GPX and a key of chain_code.json."""

from __future__ import annotations

import csv
from datetime import datetime, timedelta, timezone
import json
from pathlib import Path
from typing import Any, Final
from xml.sax.saxutils import escape

from phase_traj_ros.core.localization.estimate import LocationEstimate
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.maps.projection import bearing_deg
from phase_traj_ros.io.maps.road_file import ATTRIBUTION
from phase_traj_ros.io.results.content import write_json
from phase_traj_ros.io.results.files import seconds_text
from phase_traj_ros.tasks.location.run import Located, LocatedPose

LOCATION_COLUMNS: Final = (
    'stamp', 'latitude', 'longitude', 'heading_deg', 'probability', 'standard_deviation')
REPORT: Final = 'location.html'
LOCATION_FILES: Final = ('location.csv', 'track.geojson', 'track.gpx', REPORT)
"""Files that a located drive has in its folder."""

# Candidates in chain_code.json.
_MOST_CANDIDATES: Final = 5
# Earlier stamps count from the start of a recording, and not from 1970: 2001 and later.
_EPOCH_NS: Final = 10**18


def write_location(located: Located, directory: Path) -> None:
    """Write location.csv, track.geojson and track.gpx into a folder."""
    write_rows(located, directory / 'location.csv')
    write_geojson(located, directory / 'track.geojson')
    write_gpx(located, directory / 'track.gpx')


def write_rows(located: Located, path: Path) -> None:
    """
    Write one row per pose as CSV.

    Latitude and longitude in degrees, the compass bearing in degrees clockwise from north, and
    the standard deviation of the position in metres are empty while the place is not known.
    """
    with path.open('w', encoding='utf-8', newline='') as file:
        table = csv.writer(file, lineterminator='\n')
        table.writerow(LOCATION_COLUMNS)
        for pose in located.poses:
            probability = 0.0 if pose.estimate is None else pose.estimate.probability
            place, bearing, deviation = ('', ''), '', ''
            if pose.claim is not None:
                latitude, longitude = degrees(located, pose.claim)
                place = f'{latitude:.8f}', f'{longitude:.8f}'
                bearing = f'{float(bearing_deg(pose.claim.heading)):.2f}'
                deviation = f'{pose.claim.standard_deviation:.2f}'
            table.writerow((
                seconds_text(pose.stamp_ns), *place, bearing, f'{probability:.6f}', deviation))


def write_geojson(located: Located, path: Path) -> None:
    """Write the known parts of the track as lines of a GeoJSON FeatureCollection."""
    features = [{
        'type': 'Feature',
        'properties': {
            'start': track[0].stamp_ns / 1e9, 'end': track[-1].stamp_ns / 1e9,
            'source': located.odometry.source, 'map': located.roads.source},
        'geometry': {'type': 'LineString', 'coordinates': _coordinates(located, track)},
    } for track in located.tracks if len(track) > 1]
    write_json({
        'type': 'FeatureCollection', 'attribution': ATTRIBUTION, 'features': features}, path)


def write_gpx(located: Located, path: Path) -> None:
    """Write the known parts of the track as segments of a GPX track."""
    text = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<gpx version="1.1" creator="phase_traj_ros" xmlns="http://www.topografix.com/GPX/1/1">',
        '<metadata><copyright author="OpenStreetMap contributors"/></metadata>',
        f'<trk><name>{escape(located.odometry.source)}</name>']
    for track in located.tracks:
        text.append('<trkseg>')
        for pose, (longitude, latitude) in zip(track, _coordinates(located, track)):
            time = f'<time>{_utc(pose.stamp_ns)}</time>' if pose.stamp_ns >= _EPOCH_NS else ''
            text.append(f'<trkpt lat="{latitude}" lon="{longitude}">{time}</trkpt>')
        text.append('</trkseg>')
    path.write_text('\n'.join([*text, '</trk></gpx>', '']), encoding='utf-8', errors='replace')


def location_content(located: Located) -> dict[str, Any]:
    """Return what is known in the form of the files; docs/reference/files.md has the keys."""
    first, last = located.first_claim, located.poses[-1]
    near = located.near
    content: dict[str, Any] = {
        'map': located.roads.source,
        'attribution': ATTRIBUTION,
        'near': None if near is None else [near.latitude, near.longitude, near.radius],
        'scale': [located.scale.least, located.scale.most],
        'level': located.level,
        'located': first is not None,
        'first_claim': None if first is None else _pose_content(located, first),
        'last': _pose_content(located, last),
        'claimed_share': (
            sum(pose.claim is not None for pose in located.poses) / len(located.poses)),
    }
    estimate = last.estimate
    if estimate is not None and not estimate.claimed:
        content['candidates'] = [
            {**_place(located, each.x, each.y, each.heading),
             'probability': round(each.probability, 6)}
            for each in estimate.candidates[:_MOST_CANDIDATES]]
    return content


def add_to_chain_code(located: Located, source: Path, target: Path) -> None:
    """
    Write the chain_code.json of a replay again, with the key ``location``.

    Raises
    ------
    ResultError
        ``source`` is not what a replay writes.

    """
    try:
        content = json.loads(source.read_text(encoding='utf-8'))
        write_json({**content, 'location': location_content(located)}, target)
    except (OSError, TypeError, ValueError) as error:
        raise ResultError(f'{source} cannot be read ({error}): replay again') from None


def degrees(located: Located, estimate: LocationEstimate) -> tuple[float, float]:
    """Return latitude and longitude of an estimate, in degrees."""
    latitude, longitude = located.roads.projection.to_degrees(estimate.x, estimate.y)
    return float(latitude), float(longitude)


def _pose_content(located: Located, pose: LocatedPose) -> dict[str, Any]:
    content: dict[str, Any] = {
        'stamp_ns': pose.stamp_ns, 'driven': round(pose.driven, 3),
        'probability': (
            0.0 if pose.estimate is None else round(pose.estimate.probability, 6))}
    if pose.claim is not None:
        content |= _place(located, pose.claim.x, pose.claim.y, pose.claim.heading)
        content['standard_deviation'] = round(pose.claim.standard_deviation, 3)
        content['metres_per_unit'] = round(pose.claim.scale, 5)
    return content


def _place(located: Located, x: float, y: float, heading: float) -> dict[str, float]:
    latitude, longitude = located.roads.projection.to_degrees(x, y)
    return {
        'latitude': round(float(latitude), 8), 'longitude': round(float(longitude), 8),
        'heading_deg': round(float(bearing_deg(heading)), 2)}


def _coordinates(located: Located, track: list[LocatedPose]) -> list[tuple[float, float]]:
    """Return longitude and latitude of each pose, as GeoJSON has them."""
    claims = [pose.claim for pose in track]
    latitude, longitude = located.roads.projection.to_degrees(
        [claim.x for claim in claims if claim is not None],
        [claim.y for claim in claims if claim is not None])
    return [
        (round(east, 8), round(north, 8))
        for east, north in zip(longitude.tolist(), latitude.tolist())]


def _utc(stamp_ns: int) -> str:
    time = datetime(1970, 1, 1, tzinfo=timezone.utc) + timedelta(microseconds=stamp_ns // 1000)
    return time.isoformat().replace('+00:00', 'Z')
