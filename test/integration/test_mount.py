# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node with a camera whose place is on /tf_static."""

import json
import math
from types import SimpleNamespace

from nav_msgs.msg import Odometry
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.ros.nodes.node import PhaseTrajNode
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

# A camera 1.65 m above the ground, looking ahead: its z axis is that of the vehicle's x.
CAMERA = SimpleNamespace(
    header=SimpleNamespace(frame_id='base_link'), child_frame_id='camera',
    transform=SimpleNamespace(
        translation=SimpleNamespace(x=1.2, y=0.0, z=1.65),
        rotation=SimpleNamespace(x=-0.5, y=0.5, z=-0.5, w=0.5)))


@pytest.fixture
def made(domain, tmp_path):
    """Return a maker of an active node in this process, with the executor that spins it."""
    executors = []

    def make(*arguments):
        rclpy.init(args=['--ros-args', '-p', f'output_dir:={tmp_path / "kept"}', *arguments])
        node, executor = PhaseTrajNode(), SingleThreadedExecutor()
        executor.add_node(node)
        executors.append((node, executor))
        return node, executor

    yield make
    for node, executor in executors:
        executor.shutdown()
        node.destroy_node()
    rclpy.shutdown()


def tell(node, *transforms):
    node._work._mount_input.add(SimpleNamespace(transforms=transforms))


def show(node, count, start=0):
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 256, (96, 160), np.uint8)
    for index in range(start, start + count):
        node._work._on_frame(StampedFrame(
            np.roll(picture, 3 * index, axis=1), 10**18 + index * 10**8, 'mono8', 'camera'))


def saved_mount(node, folder):
    """End the drive; return what its file has of the mount."""
    node._drop_work()
    newest = max((folder / 'kept').iterdir(), key=lambda each: int(each.name.rpartition('_')[2]))
    return json.loads((newest / 'chain_code.json').read_text())['mount']


def has_odometry(node):
    return any(
        each.msg_type is Odometry and each.topic_name == '/phase_traj/odom'
        for each in node.publishers)


@pytest.mark.parametrize('images_first', [False, True])
def test_the_place_of_the_camera_makes_metres(made, capfd, tmp_path, images_first):
    node, executor = made('-p', 'speed:=0.0')
    assert not has_odometry(node)
    if images_first:
        show(node, 5)
        assert node._work._estimator.frames == 5
    tell(node, CAMERA)
    show(node, 1)
    executor.spin_once(timeout_sec=0)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    assert has_odometry(node)
    said = capfd.readouterr().err
    assert '/tf_static: camera is 1.65 m above base_link, 1.20 m ahead' in said
    assert 'from there: camera_height' in said
    assert node._work._estimator.settings.camera_height == pytest.approx(1.65)
    # What was coded before is saved, and the same transform again changes nothing.
    assert len(list((tmp_path / 'kept').iterdir())) == images_first
    work = node._work
    tell(node, CAMERA)
    show(node, 3)
    executor.spin_once(timeout_sec=0)
    assert node._work is work and work._estimator.frames == 3
    node._work.check(node._live.values)


def test_what_cannot_be_used_is_said_and_the_node_goes_on(made, capfd):
    # In metres, the frame of odom would be its own child.
    node, executor = made('-p', 'child_frame_id:=base_link', '-p', 'frame_id:=base_link')
    tell(node, CAMERA)
    show(node, 3)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    assert "not used: parameters 'frame_id' and 'child_frame_id'" in capfd.readouterr().err
    assert not has_odometry(node) and node._work._estimator.frames == 3


def test_a_calibrated_camera_is_tilted_as_it_is_mounted(made, capfd):
    """Of a turn, a camera that looks down by 25 degrees sees the cosine."""
    node, executor = made()
    half = math.radians(25.0) / 2
    steep = SimpleNamespace(
        header=SimpleNamespace(frame_id='base_link'), child_frame_id='camera',
        transform=SimpleNamespace(
            translation=SimpleNamespace(x=1.2, y=0.0, z=1.65),
            rotation=SimpleNamespace(x=0.0, y=math.sin(half), z=0.0, w=math.cos(half))))
    tell(node, steep)
    show(node, 1)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    work = node._work
    work._on_camera(CameraModel.pinhole((96, 160), 120.0))
    show(node, 2)
    lens = work._estimator.heading.camera.lens
    assert lens.camera is not None and lens.tilt == pytest.approx(math.cos(math.radians(25.0)))
    work._on_camera(CameraModel.pinhole((96, 160), 140.0))
    assert work._estimator.heading.camera.lens.tilt == lens.tilt
    assert 'looks' not in capfd.readouterr().err


def test_a_given_speed_is_that_of_the_vehicle_wherever_the_camera_is(made, monkeypatch):
    node, executor = made('-p', 'speed:=5.0', '-p', 'hfov_deg:=60.0')
    aside = SimpleNamespace(**vars(CAMERA))
    aside.transform = SimpleNamespace(
        translation=SimpleNamespace(x=1.2, y=0.6, z=1.65), rotation=CAMERA.transform.rotation)
    tell(node, aside)
    show(node, 1)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    seen = []
    monkeypatch.setattr(
        node._work._outputs, 'publish', lambda _, update: seen.append(update.odometry))
    show(node, 6)
    assert len(seen) == 5 and abs(seen[-1].yaw_rate) > 0.1
    assert {each.speed for each in seen} == {5.0}


@pytest.mark.parametrize('before', [0, 3])
def test_the_rule_of_the_paper_needs_no_calibration_for_a_camera_on_a_vehicle(
        made, capfd, tmp_path, before):
    node, executor = made('-p', 'threshold:=2.0')
    show(node, before)
    tell(node, CAMERA)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    show(node, 3, start=before)
    # The drive goes on.
    assert node._work._estimator.frames == before + 3 and not has_odometry(node)
    assert 'tf_static' not in capfd.readouterr().err
    assert saved_mount(node, tmp_path)['found'] == {}


def test_a_mount_that_changes_a_little_is_used_as_one_that_changes_much(made):
    node, executor = made()
    moved = SimpleNamespace(**vars(CAMERA))
    moved.transform = SimpleNamespace(
        translation=SimpleNamespace(x=1.2, y=0.0, z=1.653), rotation=CAMERA.transform.rotation)
    for transform in (CAMERA, moved):
        tell(node, transform)
        show(node, 1)
        for _ in range(5):
            executor.spin_once(timeout_sec=0)
    assert node._work._estimator.settings.camera_height == pytest.approx(1.653)
    change, = node.set_parameters([Parameter('max_gap', value=2.0)])
    assert change.successful
    # What has no effect, such as the rounding of another chain of frames, does not end the drive.
    work, far = node._work, SimpleNamespace(**vars(CAMERA))
    far.transform = SimpleNamespace(
        translation=SimpleNamespace(x=9.0, y=1e-12, z=1.653 + 1e-12),
        rotation=CAMERA.transform.rotation)
    tell(node, far)
    show(node, 2)
    assert node._work is work and work._estimator.frames == 2
    assert work.mounting.mount.x == 9.0
    change, = node.set_parameters([Parameter('max_gap', value=3.0)])
    assert change.successful
    # Nor does another mount, where the paper's rule has followed.
    work.stop()
    change, = node.set_parameters([Parameter('threshold', value=2.0)])
    assert change.successful
    work.start()
    aside = SimpleNamespace(**vars(CAMERA))
    aside.transform = SimpleNamespace(
        translation=SimpleNamespace(x=1.2, y=0.3, z=1.653), rotation=CAMERA.transform.rotation)
    for start, transform in ((0, CAMERA), (3, aside)):
        tell(node, transform)
        show(node, 3, start)
        for _ in range(5):
            executor.spin_once(timeout_sec=0)
    assert node._work is work and work._estimator.frames == 6 and has_odometry(node)


def test_of_two_mounts_the_newer_one_is_used(made):
    node, executor = made('-p', 'camera_pitch_deg:=1.0', '-p', 'camera_roll_deg:=1.0')
    show(node, 1)
    tell(node, CAMERA)
    low = SimpleNamespace(**vars(CAMERA))
    low.transform = SimpleNamespace(
        translation=SimpleNamespace(x=1.2, y=0.0, z=0.001), rotation=CAMERA.transform.rotation)
    tell(node, low)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    assert node._work._estimator.settings.camera_height == 0.0


def test_a_threshold_that_is_set_later_leaves_the_metres(made):
    node, executor = made()
    tell(node, CAMERA)
    show(node, 1)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    for threshold in (2.0, 0.0):
        show(node, 3)
        node._work.stop()
        change, = node.set_parameters([Parameter('threshold', value=threshold)])
        assert change.successful
        node._work.start()
        for _ in range(5):
            executor.spin_once(timeout_sec=0)
        show(node, 3)
        assert node._work._estimator.frames == 3
        assert node._work._estimator.settings.camera_height == pytest.approx(1.65)
        assert has_odometry(node)


def test_a_parameter_wins(made, capfd, tmp_path):
    node, executor = made('-p', 'camera_height:=1.2')
    tell(node, CAMERA)
    show(node, 1)
    for _ in range(5):
        executor.spin_once(timeout_sec=0)
    assert 'camera_height' not in capfd.readouterr().err.split('from there: ')[1]
    assert node._work._estimator.settings.camera_height == 1.2
    show(node, 2)
    mount = saved_mount(node, tmp_path)
    assert mount['height'] == pytest.approx(1.65)
    assert set(mount['found']) == {'camera_pitch_deg', 'camera_roll_deg'}
