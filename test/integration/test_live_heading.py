# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Heading and turns, live and replayed."""

import csv
from functools import partial
from itertools import groupby
import json
import math
import re

import cv2
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import (
    PoseStamped,
    QuaternionStamped,
    Twist,
    TwistStamped,
    Vector3,
    Vector3Stamped,
)
from lifecycle_msgs.msg import Transition
from live import image, LATCHED, LOSSLESS
from nav_msgs.msg import Odometry, Path
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import Lens, Movement
from phase_traj_ros.core.codes.text import parse_links
from phase_traj_ros.io.messages.camera_info import camera_from_info
from phase_traj_ros.io.params_file import read_parameters
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import Speed, StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.synthetic import render_drive
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo
from smaller import half_demo
from std_msgs.msg import Float64, Header, String, UInt8
from std_srvs.srv import Trigger


@pytest.fixture(scope='module')
def drive():
    """Return the demo's drive up to the end of its second turn, and its frames."""
    drive = half_demo(135)
    return drive, list(render_drive(drive))


def all_heard(heard, **counts):
    return all(len(heard[name]) == count for name, count in counts.items())


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
    saved = json.loads((tmp_path / 'kept' / 'phase_traj_1' / 'chain_code.json').read_text())
    assert [turn['quarter_turns'] for turn in saved['turns']] == [1, -1]
    directions = [each.data for each in heard['direction']]
    assert [code for code, _ in groupby(directions)] == [1, 0, 1]


def calibration(drive, stamp=0):
    camera = drive.camera
    matrix = camera.matrix()
    return CameraInfo(
        header=Header(stamp=MESSAGES.time(stamp)), width=camera.width, height=camera.height,
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
    live.until_said('no calibration has arrived on /front/camera_info', process=node)
    information.publish(CameraInfo(width=1, height=1))
    live.until_said('is not calibrated', process=node)
    information.publish(calibration(drive))
    live.until_said('calibration from /front/camera_info', process=node)
    # All speeds first: the two topics are not in step.
    steps = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T)
    for stamp, way in zip(drive.stamps_ns.tolist(), steps.tolist()):
        speedometer.publish(TwistStamped(
            header=Header(stamp=MESSAGES.time(stamp)), twist=Twist(linear=Vector3(x=way / 0.1))))
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
    assert (first.header.frame_id, first.child_frame_id) == ('odom', 'base_link')
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
            header=Header(stamp=MESSAGES.time(stamp)), twist=Twist(linear=Vector3(x=speed))))

    def said(text):
        live.until_said(text, process=node)

    other = calibration(drive)
    other.width, other.height = 640, 480
    information.publish(other)
    said('640x480')
    show(0, 1)
    said('but the calibration of the camera is for 640x480')
    information.publish(calibration(drive))
    said('new calibration')
    drive_at(math.nan, stamps[0])
    said('speed is nan')
    # Nothing orders what comes on two topics: on a busy machine a speed may be seconds late.
    drive_at(8.0, stamps[0])
    # The stamp of the frame that was skipped has been used.
    shown = 1
    # Until then, odom goes on with an unknown speed.
    while not any(each.twist.covariance[0] < 1.0 for each in odom):
        assert shown < 80, live.logs()
        drive_at(8.0, stamps[shown])
        show(shown, shown + 1)
        shown += 1
        live.until(lambda pairs=shown - 2: len(status) == pairs, process=node)
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
    live.until(lambda: len(status) == shown + 38, process=node)
    # The change alone has broken the series, wherever between the images it was taken.
    assert [each.data for each in status].count('reprimed') == 1
    assert max(abs(np.diff([each.data for each in heading]))) < math.radians(6)
    # The road goes on, by the height that the speeds have told.
    said('it is measured on the road')
    assert re.search(r'the newest is \d+\.\d+ s older', live.logs())
    live.until(lambda: len(odom) >= shown + 34, process=node)
    speeds = [
        each.twist.twist.linear.x for each in odom if each.twist.covariance[0] < 100.0]
    given = [speed for speed in speeds if speed == pytest.approx(8.0, abs=1e-9)]
    assert speeds[:len(given)] == given and len(given) <= shown + 25
    assert all(0.0 < speed < 16.0 for speed in speeds[len(given):])


def heard_of(live, *names):
    kinds = {'movement': UInt8, 'direction': UInt8, 'heading': Float64, 'shift': Vector3Stamped,
             'status': String, 'pair': DiagnosticArray}
    return {name: live.listen(kinds[name], f'phase_traj/{name}', LOSSLESS) for name in names}


def test_nothing_known_is_coded_as_a_replay_in_one_pass_has_it(live, drive, tmp_path):
    drive, frames = drive
    folder = tmp_path / 'drive'
    folder.mkdir()
    for index, frame in enumerate(frames):
        cv2.imwrite(str(folder / f'{index:04}.png'), frame)
    (folder / 'times.txt').write_text(''.join(
        f'{stamp // 10**9}.{stamp % 10**9:09}\n' for stamp in drive.stamps_ns.tolist()))
    node = live.start('-p', f'output_dir:={tmp_path / "kept"}', '-p', 'code_step:=3.0')
    heard = heard_of(live, 'movement', 'direction', 'heading', 'shift', 'status', 'pair')
    links = live.listen(String, 'phase_traj/links', LATCHED)
    told = live.listen(String, 'phase_traj/camera', LATCHED)
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    camera = live.camera()
    for frame, stamp in zip(frames, drive.stamps_ns.tolist()):
        camera.publish(image(frame, stamp))
    live.until(lambda: all(
        len(heard[name]) == len(frames) - 1 for name in ('movement', 'heading', 'shift')),
        process=node)
    assert not main([
        'replay', str(folder), '--one-pass', '-p', 'code_step:=3.0', '--output',
        str(tmp_path / 'one')])
    code = json.loads((tmp_path / 'one' / 'chain_code.json').read_text())
    assert code['last_stamp_ns'] == drive.stamps_ns[-1]
    assert code['code_source'] == 'auto' and code['camera']['origin'] == 'drive'
    assert [each.data for each in heard['movement']] == code['movement']
    live.until(lambda: len(heard['direction']) == len(code['direction']))
    assert [each.data for each in heard['direction']] == code['direction']
    live.until(lambda: len(heard['status']) == len(frames) - 1)
    assert [each.data for each in heard['status']] == code['status']
    # In files the heading has four decimals.
    assert np.degrees([each.data for each in heard['heading']]) == pytest.approx(
        code['heading_deg'][1:], abs=6e-5)
    assert [each for each in code['movement'] if each in (0, 2)] == [0, 2]
    # So is the way: in camera heights, as nothing tells metres.
    live.until(lambda: len(heard['pair']) == len(frames) - 1)
    told_pairs = [
        {each.key: each.value for each in message.status[0].values} for message in heard['pair']]
    with (tmp_path / 'one' / 'shifts.csv').open(newline='') as file:
        for row, pair in zip(csv.DictReader(file), told_pairs, strict=True):
            assert row['distance_state'] == pair['distance_state']
            assert row['distance'] == (
                f'{float(pair["distance"]):.5f}' if pair['distance'] else '')
    assert code['distance_unit'] == code['code_step_unit'] == 'camera heights'
    assert len(code['links']) == pytest.approx(code['distance'] / 3.0, abs=1)
    live.until(lambda: parse_links(links[-1].data).links.length == len(code['links']))
    assert parse_links(links[-1].data).links.runs == tuple(map(tuple, code['links_runs']))
    # What it has learned is told, and kept in a file that the next start takes.
    live.until(lambda: told and 'learned from' in told[-1].data, process=node)
    live.until_said('assumed until a turn determines it', told[-1].data)
    assert live.call(Trigger, 'phase_traj/save', Trigger.Request()).success
    kept = read_parameters(tmp_path / 'kept' / 'phase_traj_1' / 'camera.yaml')
    saved = json.loads((tmp_path / 'kept' / 'phase_traj_1' / 'chain_code.json').read_text())
    assert saved['camera'] == code['camera']
    assert kept.settings.lens.focal_for(frames[0].shape[1]) == pytest.approx(
        code['focal_px'], rel=0.02)
    assert code['focal_px'] == pytest.approx(drive.camera.focal, rel=0.1)


def test_a_calibration_that_comes_late_is_taken_once(live, drive):
    drive, frames = drive
    stamps = drive.stamps_ns.tolist()
    node = live.start('-p', 'qos_overrides./camera_info.subscription.reliability:=reliable')
    heard = heard_of(live, 'movement', 'direction', 'heading')
    told = live.listen(String, 'phase_traj/camera', QoSProfile(
        depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    camera = live.camera()
    information = live.camera('camera_info', kind=CameraInfo)
    for frame, stamp in zip(frames[:20], stamps):
        camera.publish(image(frame, stamp))
    # It does not wait for it.
    live.until(lambda: len(heard['movement']) == 19, process=node)
    live.until(lambda: len(told) == 1, process=node)
    assert 'assumed' in told[0].data
    for _ in range(3):
        information.publish(calibration(drive))
    live.until_said('calibration from /camera_info', process=node)
    for frame, stamp in zip(frames[20:], stamps[20:]):
        camera.publish(image(frame, stamp))
    live.until(lambda: len(heard['movement']) == len(heard['heading']) == len(frames) - 1,
               process=node)
    codes = [each.data for each in heard['movement']]
    assert [code for code in codes if code in (0, 2)] == [0, 2]
    live.until(lambda: len(heard['direction']) == len(codes) - codes.count(3))
    # Told once, and the last word: nothing is learned any more.
    live.until(lambda: 'from the calibration' in told[-1].data)
    assert [each.data for each in told if 'calibration' in each.data] == [told[-1].data]
    live.until_said(f'camera: {told[-1].data}')
    assert live.logs().count(f'camera: {told[-1].data}') == 1
    truth = np.unwrap(drive.poses[:, 2])[1:]
    error = np.degrees([each.data for each in heard['heading']] - truth)
    assert np.abs(error[20:]).max() < 3


def test_a_threshold_at_run_time_is_the_papers_rule(live, drive):
    drive, frames = drive
    # With an offset, nothing of the lens is learned, which a reset would keep.
    node = live.start('-p', f'focal_px:={drive.camera.focal}', '-p', 'lens_offset:=0.0001')
    heard = heard_of(live, 'movement', 'direction', 'shift')
    camera = live.camera()
    # Up to the end of the first turn.
    images = [
        StampedFrame(frame, stamp, 'mono8')
        for frame, stamp in zip(frames[:65], drive.stamps_ns.tolist())]
    for threshold in (0.0, 12.0, 0.0):
        if any(heard.values()):
            # No parameter restarts the codes of an active node.
            refused = live.set_parameter('threshold', threshold)
            assert not refused.successful and 'while the node is inactive' in refused.reason
        assert live.change_state(Transition.TRANSITION_DEACTIVATE)
        assert live.set_parameter('threshold', threshold).successful
        assert live.change_state(Transition.TRANSITION_ACTIVATE)
        live.until(lambda: camera.get_subscription_count() == 1, process=node)
        for messages in heard.values():
            messages.clear()
        for each in images:
            camera.publish(image(each.image, each.stamp_ns))
        expected = replay(
            images, Parameters(
                threshold=threshold, focal_px=float(drive.camera.focal), lens_offset=0.0001),
            source='the same')
        pairs, directions = len(images) - 1, len(expected.direction)
        live.until(partial(all_heard, heard, movement=pairs, shift=pairs), process=node)
        live.until(partial(all_heard, heard, direction=directions))
        assert Movement.LEFT in expected.movement
        assert [each.data for each in heard['movement']] == expected.movement
        assert [each.data for each in heard['direction']] == expected.direction
        assert [each.vector.x for each in heard['shift']] == pytest.approx(
            [update.shift.dx for update in expected.updates], abs=1e-6)
        assert len(expected.direction) == len(images) - 1 - expected.movement.count(3)
    live.until_said('restarted, with codes from the shift, threshold 12 px/frame')
    assert live.logs().count('restarted, with codes from the turns') == 1


def test_real_driving(kitti_root, tmp_path):
    params = tmp_path / 'heading.yaml'
    params.write_text('/**:\n  ros__parameters: {code_source: heading, focal_px: 718.856}\n')
    assert not main([
        'replay', str(kitti_root / '00'), '--params', str(params), '--output',
        str(tmp_path / 'out')])
    code = json.loads((tmp_path / 'out' / 'chain_code.json').read_text())
    poses = np.loadtxt(kitti_root / '00' / 'poses.txt').reshape(-1, 3, 4)
    truth = -np.degrees(np.unwrap(np.arctan2(poses[:, 0, 2], poses[:, 2, 2])))
    error = code['heading_deg'] - (truth - truth[0])
    assert abs(error[-1]) <= 1.0
    assert np.abs(error).max() <= 4.0
    assert len(code['turns']) == 1
    assert len(code['direction']) == len(code['movement']) - code['movement'].count(3)
