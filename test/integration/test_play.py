# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings on real topics."""

import signal
import subprocess
import sys
from threading import Event

import cv2
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.ros.playback.player import FramePlayer
from phase_traj_ros.ros.spin import ros_context, spinning
import pytest
from rcl_interfaces.srv import ListParameters
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

SENSOR = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture
def recording(tmp_path):
    """Return a folder of pictures."""
    rng = np.random.default_rng(0)
    texture = np.kron(rng.integers(0, 256, (24, 40), np.uint8), np.ones((4, 4), np.uint8))
    folder = tmp_path / 'pictures'
    folder.mkdir()
    for index in range(20):
        cv2.imwrite(str(folder / f'{index:03}.png'), np.roll(texture, 2 * index, axis=1))
    return folder


def playing(recording, *options):
    """Play in a process of its own."""
    return subprocess.Popen(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', 'play', str(recording), *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture
def play(capfd, domain, recording):
    """Return a function that plays in this process, and returns what is said and the status."""
    def made(*options):
        status = main(['play', str(recording), *options])
        return (*capfd.readouterr(), status)
    return made


def test_no_frame_is_lost_at_the_start(live, recording):
    """Not even one that is sent once; the queue here is long enough for all of them."""
    images = live.listen(Image, '/image', SENSOR)
    with playing(recording, '--rate', '2') as player:
        live.until(lambda: player.poll() is not None)
        assert player.communicate() == ('published 20 frames\n', '')
    live.until(lambda: len(images) == 20)
    assert player.returncode == 0


def test_the_player_answers_while_it_plays(live, recording, monkeypatch):
    # rclpy says so where the player sees a request before it sees who asks; it is asked again.
    monkeypatch.setenv('PYTHONWARNINGS', 'ignore:failed to send response:RuntimeWarning')
    images = live.listen(Image, '/image', SENSOR)
    with playing(recording, '--loop') as player:
        try:
            # Before and after it has asked its subscriber.
            for _ in range(2):
                asked = live.call(
                    ListParameters, '/phase_traj_player/list_parameters', ListParameters.Request())
                assert 'use_sim_time' in asked.result.names
                live.until(lambda: images, process=player)
            player.send_signal(signal.SIGINT)
            assert player.communicate()[1] == ''
        finally:
            player.kill()
    assert player.returncode == 0


def test_images_keep_the_frame_of_the_recording(live):
    """A node finds its mount on /tf_static by this name, as a replay of the bag does."""
    images = live.listen(Image, '/image')
    with ros_context([]):
        player = FramePlayer(lossless=True)
        with spinning(player):
            assert player.wait_for_subscribers(Event(), timeout_s=60.0)
            player.play([
                StampedFrame(np.zeros((8, 8), np.uint8), 10**9, frame_id='front_camera')], Event())
            live.until(lambda: images)
    assert images[0].header.frame_id == 'front_camera'


def test_a_jump_of_the_stamps_is_not_waited_for(live, capfd):
    images = live.listen(Image, '/image')
    stamps = [0, 10**18, 10**18 + 10**8, 2 * 10**18, 10**18 + 2 * 10**8]
    with ros_context([]):
        player = FramePlayer(lossless=True)
        with spinning(player):
            assert player.wait_for_subscribers(Event(), timeout_s=60.0)
            frame = np.zeros((8, 8), np.uint8)
            assert player.play([StampedFrame(frame, stamp) for stamp in stamps], Event()) == 5
            live.until(lambda: len(images) == 5)
    said = capfd.readouterr().err
    assert 'the stamp of frame 1 is 1000000000 s later than the one before' in said


def test_the_clock_is_left_to_others_unless_it_is_asked_for(live, recording):
    """The clock sets the time of every node with use_sim_time, also on a vehicle that drives."""
    images, ticks = live.listen(Image, '/image'), live.listen(Clock, '/clock')
    with playing(recording, '--lossless', '--rate', '2'):
        live.until(lambda: len(images) == 20)
        assert ticks == [] and live.node.count_publishers('/clock') == 0
    with playing(recording, '--lossless', '--rate', '2', '--clock', '100'):
        # With each image, and in between.
        live.until(lambda: len(images) == 40 and len(ticks) > 20)
    times = [each.clock.sec + each.clock.nanosec / 1e9 for each in ticks]
    assert times == sorted(times)


def test_where_nobody_subscribes_it_is_said(play):
    out, said, status = play('--rate', '1000', '--wait', '0.1')
    assert 'warning: no subscriber to /image with a matching quality of service' in said
    assert (out, status) == ('published 20 frames\n', 0)


def test_a_stamp_that_no_message_can_hold_is_refused(play, recording):
    (recording / 'times.txt').write_text(''.join(f'{2**31 - 1 + each}\n' for each in range(20)))
    out, said, status = play('--rate', '1000', '--wait', '0')
    assert (out, status) == ('', 2)
    assert 'a message cannot hold the stamp 2147483648.000000000 s' in said


@pytest.mark.parametrize('topic', ['/front-camera/image_raw', 'bad topic', '/'])
def test_a_name_that_no_topic_can_have(play, topic):
    out, said, status = play('--image-topic', topic)
    assert (out, status) == ('', 2)
    assert said.startswith(f"phase_traj: error: '{topic}': invalid topic name: ")
    assert len(said.splitlines()) == 1
