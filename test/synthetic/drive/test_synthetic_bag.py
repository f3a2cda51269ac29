# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A drive as a bag, read back with rosbags."""

from pathlib import Path
import sys

import numpy as np
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.synthetic import (
    Camera,
    plan_drive,
    render_drive,
    Straight,
    Turn,
    write_drive_bag,
)
from phase_traj_ros.synthetic.camera import STEREOGRAPHIC
import pytest

SMALL = Camera.with_field_of_view(161, 95, 80.0)


@pytest.fixture(scope='module')
def drive():
    """Return a short drive with a small camera."""
    return plan_drive(
        'short', [Straight(0.2), Turn(30, 0.5)], camera=SMALL, rate_hz=10.0)


@pytest.fixture(scope='module')
def bag(drive, tmp_path_factory):
    """Return the bag of that drive."""
    path = tmp_path_factory.mktemp('bags') / 'drives' / 'short'
    write_drive_bag(drive, path, image_topic='/front/image_raw')
    return path


def messages(path):
    """Return {topic: [(stamp of the record, message)]}."""
    from rosbags.highlevel import AnyReader
    found = {}
    with AnyReader([path]) as reader:
        for (connection, stamp, data) in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp, message))
    return found


def test_every_frame_has_its_messages_and_stamps(drive, bag):
    found = messages(bag)
    assert set(found) == {
        '/front/image_raw', '/front/camera_info', '/ground_truth/pose', '/speed'}
    for entries in found.values():
        assert [stamp for (stamp, _) in entries] == drive.stamps_ns.tolist()
        for (stamp, message) in entries:
            header = message.header.stamp
            assert header.sec * 10 ** 9 + header.nanosec == stamp


def test_images_are_the_rendered_frames(drive, bag):
    rendered = list(render_drive(drive))
    for (frame, (_, image)) in enumerate(messages(bag)['/front/image_raw']):
        assert (image.encoding, image.height, image.width, image.step) == ('mono8', 95, 161, 161)
        assert image.header.frame_id == 'camera'
        np.testing.assert_array_equal(
            image.data.reshape(95, 161), rendered[frame])


def test_the_camera_describes_itself(bag):
    for (_, info) in messages(bag)['/front/camera_info']:
        np.testing.assert_allclose(info.k, SMALL.matrix().ravel())
        np.testing.assert_allclose(info.p.reshape(3, 4)[:, :3], SMALL.matrix())
        assert (info.height, info.width, info.distortion_model) == (95, 161, 'plumb_bob')


def test_the_ground_truth_is_the_pose_of_the_camera(drive, bag):
    for (frame, (_, truth)) in enumerate(messages(bag)['/ground_truth/pose']):
        pose = drive.pose(frame)
        assert truth.header.frame_id == 'map'
        position = truth.pose.position
        assert (position.x, position.y, position.z) == (pose.x, pose.y, SMALL.above_ground)
        orientation = truth.pose.orientation
        assert 2 * np.arctan2(orientation.z, orientation.w) == pytest.approx(pose.yaw)


def test_the_speed_leads_from_frame_to_frame(drive, bag):
    speeds = [message.twist.linear.x for (_, message) in messages(bag)['/speed']]
    steps = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T)
    assert speeds[:-1] == pytest.approx(steps / np.diff(drive.stamps_ns) * 1e9)
    assert speeds[-1] == speeds[-2]


def test_the_speed_is_negative_in_reverse(tmp_path):
    drive = plan_drive('back', [Straight(1.0, 0.0), Turn(30.0, 2.0, -1.5)], camera=SMALL)
    write_drive_bag(drive, tmp_path / 'back')
    speeds = [message.twist.linear.x for (_, message) in messages(tmp_path / 'back')['/speed']]
    assert speeds[4] == 0.0 and speeds[-1] == pytest.approx(-1.5, abs=0.01)


def test_the_bag_is_mcap_named_after_its_directory(bag):
    assert sorted(path.name for path in bag.iterdir()) == ['metadata.yaml', 'short.mcap']
    # No temporary files are left beside it.
    assert list(bag.parent.iterdir()) == [bag]


def test_progress_is_called_once_a_frame(drive, tmp_path):
    calls = []
    write_drive_bag(drive, tmp_path / 'bag', progress=lambda: calls.append(None))
    assert len(calls) == len(drive)


def test_without_rosbags_the_error_says_what_to_install(drive, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'rosbags.rosbag2', None)
    with pytest.raises(MissingDependencyError, match='pip install rosbags'):
        write_drive_bag(drive, Path(tmp_path / 'bag'))
    assert list(tmp_path.iterdir()) == []


def test_the_calibration_of_a_fisheye_is_that_of_its_lens(tmp_path):
    camera = Camera.with_field_of_view(80, 60, 120.0, fisheye=STEREOGRAPHIC)
    drive = plan_drive('short', [Straight(0.2)], camera=camera, rate_hz=10.0)
    write_drive_bag(drive, tmp_path / 'fisheye')
    info = messages(tmp_path / 'fisheye')['/camera/camera_info'][0][1]
    assert info.distortion_model == 'equidistant'
    assert (info.k[0], tuple(info.d)) == (camera.focal, STEREOGRAPHIC)
