# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a located drive as CSV, GeoJSON, GPX, a report, and a key of chain_code.json."""

import csv
from datetime import datetime, timedelta, timezone
import json
from pathlib import Path
import re
from typing import Any
from xml.sax.saxutils import escape

from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.io.maps.projection import bearing_deg
from phase_traj_ros.io.maps.road_file import ATTRIBUTION
from phase_traj_ros.io.results.chain_code import write_json
from phase_traj_ros.io.results.files import seconds_text
from phase_traj_ros.tasks.location.report import write_location_report
from phase_traj_ros.tasks.location.run import Located, LocatedPose

LOCATION_COLUMNS = (
    'stamp', 'latitude', 'longitude', 'heading_deg', 'probability', 'standard_deviation')
CODES = 'chain_code.json'
REPORT = 'location.html'
LOCATION_FILES = ('location.csv', 'track.geojson', 'track.gpx', REPORT)
"""Files in the output folder of a located drive."""

# Largest number of candidates in chain_code.json.
_MOST_CANDIDATES = 5
# Stamps from 2001 on are times; smaller ones count from the start of a recording.
_EPOCH_NS = 10**18
_NOT_IN_XML = re.compile(r'[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]')


def write_location(
    located: Located, directory: Path, *, title: str, codes: Path | None = None,
) -> None:
    """
    Write the files of a located drive into a folder.

    Parameters
    ----------
    located
        The drive.
    directory
        The folder.
    title
        Heading of the report, such as the name of the source.
    codes
        The chain_code.json of its replay, which is copied with the key ``location``; None without
        a replay.

    Raises
    ------
    OSError
        The folder cannot be written.

    """
    _write_rows(located, directory / 'location.csv')
    _write_geojson(located, directory / 'track.geojson')
    _write_gpx(located, directory / 'track.gpx')
    write_location_report(located, directory / REPORT, title=title)
    if codes is not None:
        content = json.loads(codes.read_text(encoding='utf-8'))
        write_json({**content, 'location': _content(located)}, directory / CODES)


def _write_rows(located: Located, path: Path) -> None:
    """
    Write one row per pose as CSV.

    Latitude and longitude are in degrees, the bearing in degrees clockwise from north, the
    standard deviation of the position in metres. They are empty while the place is not known.
    """
    with path.open('w', encoding='utf-8', newline='') as file:
        table = csv.writer(file, lineterminator='\n')
        table.writerow(LOCATION_COLUMNS)
        for pose in located.poses:
            estimate, place, deviation = pose.estimate, ('', '', ''), ''
            if estimate.claimed:
                latitude, longitude = located.degrees(estimate)
                bearing = bearing_deg(estimate.heading)
                place = f'{latitude:.8f}', f'{longitude:.8f}', f'{bearing:.2f}'
                deviation = f'{estimate.standard_deviation:.2f}'
            table.writerow((
                seconds_text(pose.stamp_ns), *place, f'{estimate.probability:.6f}', deviation))


def _write_geojson(located: Located, path: Path) -> None:
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


def _write_gpx(located: Located, path: Path) -> None:
    """Write the known parts of the track as segments of a GPX track."""
    name = escape(_NOT_IN_XML.sub('_', located.odometry.source))
    text = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<gpx version="1.1" creator="phase_traj_ros" xmlns="http://www.topografix.com/GPX/1/1">',
        '<metadata><copyright author="OpenStreetMap contributors"/></metadata>',
        f'<trk><name>{name}</name>']
    for track in located.tracks:
        text.append('<trkseg>')
        for pose, (longitude, latitude) in zip(track, _coordinates(located, track)):
            time = f'<time>{_utc(pose.stamp_ns)}</time>' if pose.stamp_ns >= _EPOCH_NS else ''
            text.append(f'<trkpt lat="{latitude:.8f}" lon="{longitude:.8f}">{time}</trkpt>')
        text.append('</trkseg>')
    path.write_text('\n'.join([*text, '</trk></gpx>', '']), encoding='utf-8')


def _content(located: Located) -> dict[str, Any]:
    """Return the content of the key ``location``; docs/reference/files.md describes it."""
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
            sum(pose.estimate.claimed for pose in located.poses) / len(located.poses)),
    }
    if not last.estimate.claimed:
        content['candidates'] = [
            {**_place(located, each), 'probability': round(each.probability, 6)}
            for each in last.estimate.candidates[:_MOST_CANDIDATES]]
    return content


def _pose_content(located: Located, pose: LocatedPose) -> dict[str, Any]:
    estimate = pose.estimate
    content: dict[str, Any] = {
        'stamp_ns': pose.stamp_ns, 'driven': round(pose.driven, 3),
        'probability': round(estimate.probability, 6)}
    if estimate.claimed:
        content |= _place(located, estimate)
        content['standard_deviation'] = round(estimate.standard_deviation, 3)
        content['metres_per_unit'] = round(estimate.scale, 5)
    return content


def _place(located: Located, place: LocationEstimate | Candidate) -> dict[str, float]:
    latitude, longitude = located.degrees(place)
    return {
        'latitude': round(latitude, 8), 'longitude': round(longitude, 8),
        'heading_deg': round(bearing_deg(place.heading), 2)}


def _coordinates(located: Located, track: list[LocatedPose]) -> list[tuple[float, float]]:
    """Return the longitude and latitude of each pose in degrees, in the order of GeoJSON."""
    places = [located.degrees(pose.estimate) for pose in track]
    return [(round(longitude, 8), round(latitude, 8)) for latitude, longitude in places]


def _utc(stamp_ns: int) -> str:
    time = datetime(1970, 1, 1, tzinfo=timezone.utc) + timedelta(microseconds=stamp_ns // 1000)
    return time.isoformat().replace('+00:00', 'Z')
