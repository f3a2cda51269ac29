# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Heading and turns, live and replayed."""

from itertools import groupby
import json
import math
import re

from geometry_msgs.msg import (
    PoseStamped,
    QuaternionStamped,
    Twist,
    TwistStamped,
    Vector3,
    Vector3Stamped,
)
from live import image, LATCHED, LOSSLESS, SHIFT
from nav_msgs.msg import Odometry, Path
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import Lens
from phase_traj_ros.io.messages.camera_info import camera_from_info
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import Speed, StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.outputs.messages import to_time
from phase_traj_ros.synthetic import named_drive, render_drive
import pytest
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Float64, Header, String, UInt8
from std_srvs.srv import Trigger


@pytest.fixture(scope='module')
def drive():
    """Return the demo's drive up to the end of its second turn, and its frames."""
    drive = named_drive('demo').take(range(135))
    return drive, list(render_drive(drive))


def test_the_live_heading_is_the_true_one(live, drive, tmp_path):
    drive, frames = drive
    focal = f'focal_px:={drive.camera.focal}'
    live.start(
        '-p', 'code_source:=heading', '-p', focal, '-p', f'output_dir:={tmp_path / "kept"}')
    kinds = {
        'movement': UInt8, 'direction': UInt8, 'heading': Float64,
        'heading_stamped': QuaternionStamped, 'turn': Vector3Stamped}
    heard = {name: live.listen(kind, f'phase_traj/{name}', LOSSLESS)
             for name, kind in kinds.items()}
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    camera = live.camera()
    for frame, stamp in zip(frames, drive.stamps_ns.tolist()):
        camera.publish(image(frame, stamp))
    live.until(lambda: all(
        len(heard[name]) == len(drive) - 1 for name in ('movement', 'heading', 'heading_stamped')))
    truth = np.unwrap(drive.poses[:, 2])[1:]
    error = np.degrees([each.data for each in heard['heading']] - truth)
    assert np.abs(error).max() < 3
    quaternion = heard['heading_stamped'][-1].quaternion
    assert 2 * math.atan2(quaternion.z, quaternion.w) == pytest.approx(
        heard['heading'][-1].data, abs=1e-6)
    live.until(lambda: len(heard['turn']) == 2)
    angles = [math.degrees(each.vector.z) for each in heard['turn']]
    assert angles == pytest.approx([90, -90], abs=4)
    assert live.call(Trigger, 'phase_traj/save', Trigger.Request()).success
    saved = json.loads((tmp_path / 'kept' / 'chain_code.json').read_text())
    assert [turn['quarter_turns'] for turn in saved['turns']] == [1, -1]
    directions = [each.data for each in heard['direction']]
    assert [code for code, _ in groupby(directions)] == [1, 0, 1]


def calibration(drive, stamp=0):
    camera = drive.camera
    matrix = camera.matrix()
    return CameraInfo(
        header=Header(stamp=to_time(stamp)), width=camera.width, height=camera.height,
        distortion_model='plumb_bob', d=[0.0] * 5, k=matrix.ravel(),
        p=np.concatenate([matrix, np.zeros((3, 1))], axis=1).ravel())


def test_calibration_and_speed_come_on_topics(live, drive, tmp_path):
    drive, frames = drive
    values = {
        'code_source': 'heading', 'connectivity': 8, 'use_speed_topic': True,
        'path_from': 'heading'}
    node = live.start(
        *(each for name, value in values.items() for each in ('-p', f'{name}:={value}')),
        '-r', 'image:=/front/image_raw',
        '-p', 'qos_overrides./front/image_raw.subscription.reliability:=reliable',
        '-p', 'qos_overrides./front/image_raw.subscription.history:=keep_all',
        '-p', 'qos_overrides./speed.subscription.reliability:=reliable',
        '-p', 'qos_overrides./speed.subscription.history:=keep_all')
    kinds = {'direction': UInt8, 'movement': UInt8, 'odom': Odometry, 'pose': PoseStamped}
    heard = {name: live.listen(kind, f'phase_traj/{name}', LOSSLESS)
             for name, kind in kinds.items()}
    paths = live.listen(Path, 'phase_traj/path', LATCHED)
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    camera = live.camera('/front/image_raw')
    # Beside the images, though nobody has said so.
    information = live.camera('/front/camera_info', kind=CameraInfo)
    speedometer = live.camera('/speed', kind=TwistStamped)
    # What comes before the calibration is not used, and what is wrong is said.
    camera.publish(image(frames[0], 1))
    live.until(lambda: 'nothing has come on /front/camera_info yet' in live.logs(), process=node)
    information.publish(CameraInfo(width=1, height=1))
    live.until(lambda: 'is not calibrated' in live.logs(), process=node)
    information.publish(calibration(drive))
    live.until(lambda: 'calibration from /front/camera_info' in live.logs(), process=node)
    # All speeds first: the two topics are not in step.
    steps = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T)
    for stamp, way in zip(drive.stamps_ns.tolist(), steps.tolist()):
        speedometer.publish(TwistStamped(
            header=Header(stamp=to_time(stamp)), twist=Twist(linear=Vector3(x=way / 0.1))))
    assert speedometer.wait_for_all_acked()
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    for frame, stamp in zip(frames, drive.stamps_ns.tolist()):
        camera.publish(image(frame, stamp))
    live.until(lambda: len(heard['movement']) == len(heard['pose']) == len(frames) - 1)
    true = drive.poses[:, :2] - drive.poses[0, :2]
    live.until(lambda: len(heard['odom']) == len(frames) - 1)
    found = np.array([
        (each.pose.pose.position.x, each.pose.pose.position.y) for each in heard['odom']])
    assert np.abs(found - true[1:]).max() < 0.03 * np.ptp(true, axis=0).max()
    first = heard['odom'][0]
    assert (first.header.frame_id, first.child_frame_id) == ('phase_traj', 'base_link')
    assert first.twist.twist.linear.x == pytest.approx(steps[0] / 0.1, rel=1e-6)
    assert all(np.array(each.pose.covariance).reshape(6, 6)[5, 5] > 0 for each in heard['odom'])
    live.until(lambda: len(paths[-1].poses) == len(frames))
    assert paths[-1].poses[-1].pose == heard['pose'][-1].pose
    assert heard['pose'][-1].pose.position.x == found[-1, 0]
    # And all of it as a replay has it.
    model = camera_from_info(calibration(drive), rectified=False)
    result = replay(
        [StampedFrame(frame, stamp, 'mono8')
         for frame, stamp in zip(frames, drive.stamps_ns.tolist())],
        Parameters(**values), source='the same', lens=Lens(camera=model), speeds=[
            Speed(stamp, way / 0.1)
            for stamp, way in zip(drive.stamps_ns.tolist(), steps.tolist())])
    assert [each.data for each in heard['movement']] == result.movement
    assert [each.data for each in heard['direction']] == result.direction
    assert set(result.direction) == {2, 3, 4}
    assert found.tolist() == [
        [update.odometry.pose.x, update.odometry.pose.y] for update in result.updates]


def test_calibrations_and_speeds_that_change_and_fail(live, drive):
    drive, frames = drive
    node = live.start(
        '-p', 'code_source:=heading', '-p', 'use_speed_topic:=true',
        '-p', 'qos_overrides./speed.subscription.reliability:=reliable',
        '-p', 'qos_overrides./camera_info.subscription.reliability:=reliable')
    status = live.listen(String, 'phase_traj/status', LOSSLESS)
    heading = live.listen(Float64, 'phase_traj/heading', LOSSLESS)
    odom = live.listen(Odometry, 'phase_traj/odom', LOSSLESS)
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    camera = live.camera()
    information = live.camera('camera_info', kind=CameraInfo)
    speedometer = live.camera('speed', kind=TwistStamped)
    stamps = drive.stamps_ns.tolist()

    def show(first, last):
        for frame, stamp in zip(frames[first:last], stamps[first:last]):
            camera.publish(image(frame, stamp))

    def drive_at(speed, stamp):
        speedometer.publish(TwistStamped(
            header=Header(stamp=to_time(stamp)), twist=Twist(linear=Vector3(x=speed))))

    def said(text):
        live.until(lambda: text in live.logs(), process=node)

    other = calibration(drive)
    other.width, other.height = 640, 480
    information.publish(other)
    said('640x480')
    show(0, 1)
    said('but the calibration of the camera is for 640x480')
    information.publish(calibration(drive))
    said('another calibration')
    drive_at(math.nan, stamps[0])
    said('speed is nan')
    # Nothing orders what comes on two topics: on a busy machine a speed may be seconds late.
    drive_at(8.0, stamps[0])
    shown = 0
    while not odom:
        assert shown < 80, live.logs()
        drive_at(8.0, stamps[shown])
        show(shown, shown + 1)
        shown += 1
        live.until(lambda pairs=shown - 1: len(status) == pairs, process=node)
        live.spin(0.1)
    trembling = calibration(drive)
    trembling.k[0] += 0.01
    information.publish(trembling)
    zoomed = calibration(drive)
    zoomed.k[0] *= 1.05
    information.publish(zoomed)
    live.until(lambda: live.node.count_subscribers('/camera_info') == 1 and information
               .wait_for_all_acked(), process=node)
    show(shown, shown + 40)
    live.until(lambda: len(status) == shown + 39, process=node)
    # The change alone has broken the series, wherever between the images it was taken.
    assert [each.data for each in status].count('reprimed') == 1
    assert max(abs(np.diff([each.data for each in heading]))) < math.radians(6)
    said('odom does not go on')
    assert re.search(r'the newest is \d+\.\d+ s older', live.logs())
    assert len(odom) <= shown + 25
    assert [each.twist.twist.linear.x for each in odom] == pytest.approx([8.0] * len(odom))


def test_a_threshold_in_degrees_needs_a_camera(live):
    live.start(*SHIFT)
    result = live.set_parameter('threshold_deg_s', 10.0)
    assert not result.successful
    assert 'settled at the start' in result.reason


@pytest.mark.parametrize(('clip', 'focal', 'turns'), [('00', 718.856, 1), ('06', 707.091, 0)])
def test_real_driving(kitti_root, tmp_path, clip, focal, turns):
    params = tmp_path / 'heading.yaml'
    params.write_text(
        f'/**:\n  ros__parameters: {{code_source: heading, focal_px: {focal}}}\n')
    assert not main([
        'replay', str(kitti_root / clip), '--params', str(params), '--output',
        str(tmp_path / 'out')])
    code = json.loads((tmp_path / 'out' / 'chain_code.json').read_text())
    poses = np.loadtxt(kitti_root / clip / 'poses.txt').reshape(-1, 3, 4)
    truth = -np.degrees(np.unwrap(np.arctan2(poses[:, 0, 2], poses[:, 2, 2])))
    error = code['heading_deg'] - (truth - truth[0])
    assert abs(error[-1]) <= 1.0
    assert np.abs(error).max() <= 4.0
    assert len(code['turns']) == turns
    assert len(code['direction']) == len(code['movement']) - code['movement'].count(3)
