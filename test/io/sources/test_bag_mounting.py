# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The place of the camera on the vehicle, from the /tf_static of a bag."""

import json
import math

from phase_traj_ros.core import LengthUnit
from phase_traj_ros.io import open_source
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.camera import mounting_of
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest
import pytest

SECOND = 1_000_000_000
IMAGE, TF, STRING = 'sensor_msgs/msg/Image', 'tf2_msgs/msg/TFMessage', 'std_msgs/msg/String'
# Quaternions of a housing that looks ahead, that looks 10 degrees down, and upside down.
AHEAD, DOWN, OVER = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0871557, 0.0, 0.9961947), (1.0, 0.0, 0.0, 0.0)


def bag(maker, path, drive_frame, *messages, kind=TF):
    """Write a bag of one image and /tf_static; return what it tells for three settings."""
    maker_path = maker.write(path, {
        '/image': (IMAGE, [(SECOND, maker.image(drive_frame(0), SECOND))]),
        '/tf_static': (kind, [(SECOND + n, message) for n, message in enumerate(messages)])})
    with open_source(maker_path) as source:
        return tuple(mounting_of(source, each) for each in (
            Parameters(), Parameters(camera_height=2.0), Parameters(threshold=4.0)))


def test_a_bag_tells_the_place_of_its_camera(tmp_path, maker, drive_frame):
    found, given, by_shift = bag(
        maker, tmp_path / 'bag', drive_frame,
        # From two publishers; the second one is late.
        maker.transforms(('mast', 'camera', (0.2, 0.0, 0.65), DOWN)),
        maker.transforms(('base_link', 'mast', (1.0, 0.0, 1.0), AHEAD)))
    assert found.parameters.camera_height == pytest.approx(1.65)
    assert found.parameters.camera_pitch_deg == pytest.approx(10.0, abs=1e-4)
    assert 'camera is 1.65 m above' in str(found)
    assert found.doubts == ()
    # Parameters win.
    assert given.parameters.camera_height == 2.0
    assert given.parameters.camera_pitch_deg == found.parameters.camera_pitch_deg
    # A height needs a lens, and the paper's rule has none.
    assert by_shift == Mounting(Parameters(threshold=4.0), found.mount)


def test_what_is_doubtful_is_said(tmp_path, mcap_maker, drive_frame):
    found, *_ = bag(
        mcap_maker, tmp_path / 'bag', drive_frame,
        mcap_maker.transforms(('base_link', 'camera', (1.0, 0.0, 1.0), OVER)))
    assert [doubt.partition(': set')[0] for doubt in found.doubts] == [
        '/tf_static: camera is mounted upside down']


def test_other_frames_tell_nothing(tmp_path, mcap_maker, drive_frame):
    for name, *messages in (('none',), ('other', mcap_maker.transforms(
            ('base_link', 'lidar', (1.0, 0.0, 1.0), AHEAD)))):
        found, *_ = bag(mcap_maker, tmp_path / name, drive_frame, *messages)
        assert found == Mounting(Parameters())


def test_a_frame_at_the_camera_tells_no_height(tmp_path, mcap_maker, drive_frame):
    found, *_ = bag(mcap_maker, tmp_path / 'bag', drive_frame, mcap_maker.transforms(
        ('base_link', 'mast', (1.0, 0.0, 0.3), AHEAD), ('mast', 'camera', (0.0, 0.0, -0.3), DOWN)))
    assert found.parameters.camera_height == 0.0
    assert found.parameters.camera_pitch_deg == pytest.approx(10.0, abs=1e-4)


def test_a_transform_that_cannot_be_read_does_not_stop_a_replay(
        tmp_path, mcap_maker, drive_frame, monkeypatch):
    message = mcap_maker.transforms(('base_link', 'camera', (1.0, 0.0, 1.0), AHEAD))
    whole = mcap_maker.typestore.serialize_cdr
    monkeypatch.setattr(
        mcap_maker.typestore, 'serialize_cdr',
        lambda each, kind: whole(each, kind)[:20 if kind == TF else None])
    found, *_ = bag(mcap_maker, tmp_path / 'bag', drive_frame, message)
    assert found.parameters == Parameters() and found.mount is None
    assert len(found.doubts) == 1 and '/tf_static is not used' in found.doubts[0]


def test_a_bag_with_its_transforms_is_replayed_in_metres(tmp_path, mcap_maker):
    Reader = pytest.importorskip('rosbags.rosbag2').Reader
    camera = Camera.with_field_of_view(320, 240, 70.0, above_ground=1.5)
    drive = plan_drive('', [Straight(3.0)], speed=6.0, seed=3, camera=camera)
    info = mcap_maker.camera_info(
        focal=camera.focal, width=320, height=240, distortion=(0.0,) * 5)
    path = mcap_maker.write(tmp_path / 'bag', {
        '/image': (IMAGE, [
            (stamp, mcap_maker.image(frame, stamp))
            for stamp, frame in zip(drive.stamps_ns.tolist(), render_drive(drive))]),
        '/camera_info': ('sensor_msgs/msg/CameraInfo', [(int(drive.stamps_ns[0]), info)]),
        '/tf_static': (TF, [(int(drive.stamps_ns[0]), mcap_maker.transforms(
            ('base_link', 'camera', (1.0, 0.4, 1.5), AHEAD)))])})
    with open_source(path) as source:
        result = replay_source(
            source, ReplayRequest(
                source=path, output=tmp_path / 'out', bag_out=tmp_path / 'out.mcap'))
    assert result.parameters.settings.length_unit is LengthUnit.METRE
    assert result.way.distance == pytest.approx(18.0, rel=0.03)
    assert result.problems == ()
    mount = json.loads((tmp_path / 'out' / 'chain_code.json').read_text())['mount']
    assert (mount['y'], mount['found']['camera_height']) == (0.4, 1.5)
    # The odometry is that of base_link, which looked ahead when it started.
    with Reader(tmp_path / 'out.mcap') as reader:
        odometry = [
            mcap_maker.typestore.deserialize_cdr(data, link.msgtype)
            for link, _, data in reader.messages() if link.topic == '/phase_traj/odom']
    end, tip = odometry[-1].pose.pose.position, result.updates[-1].odometry.pose
    assert (end.x, end.y) == pytest.approx((
        tip.x + 0.4 * math.sin(tip.yaw), tip.y + 0.4 * (1.0 - math.cos(tip.yaw))), abs=1e-9)
    assert end.x != tip.x
