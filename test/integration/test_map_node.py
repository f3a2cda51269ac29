# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node with a road map: what is there at once, and what is not claimed."""

import math

from diagnostic_msgs.msg import DiagnosticArray
from live import image, LATCHED, stop
from made_town import write_town
from rolled import rolled_frames
from sensor_msgs.msg import NavSatFix, NavSatStatus
from visualization_msgs.msg import MarkerArray


def test_the_roads_are_there_and_nothing_is_claimed(live, tmp_path):
    process = live.start(
        '-p', f'map_file:={write_town(tmp_path / "town.osm")}', '-p', 'speed:=5.0',
        '-p', 'hfov_deg:=80.0')
    roads = live.listen(MarkerArray, '/phase_traj/roads', LATCHED)
    fixes = live.listen(NavSatFix, '/phase_traj/fix')
    diagnostics = live.listen(DiagnosticArray, '/diagnostics')
    camera = live.camera()
    live.until(lambda: roads, process=process)
    for frame in rolled_frames():
        camera.publish(image(frame.image, frame.stamp_ns))
    live.until(lambda: fixes, process=process)

    refused = live.set_parameter('threshold', 16.0)
    assert not refused.successful and 'needs the measured heading' in refused.reason
    assert roads[0].markers[0].header.frame_id == 'map'
    assert fixes[0].status.status == NavSatStatus.STATUS_NO_FIX
    assert math.isnan(fixes[0].latitude)
    live.until(lambda: any(
        status.name.endswith('location') for each in diagnostics for status in each.status),
        process=process)
    assert stop(process) == 0


def test_a_bad_map_ends_the_start_in_one_line(live, tmp_path):
    (tmp_path / 'town.osm').write_text('<osm></osm>')
    process = live.start('-p', f'map_file:={tmp_path / "town.osm"}')

    assert process.wait() == 2
    assert 'has no roads that a car may drive' in live.logs()
    assert 'Traceback' not in live.logs()
