# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings on real topics."""

import subprocess
import sys

import cv2
from live import LATCHED
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String


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


def play(recording, *options):
    return subprocess.run(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', 'play', str(recording), *options],
        capture_output=True, text=True, check=False)


def test_no_frame_is_lost_at_the_start(live, recording):
    live.start(lossless=False)
    texts = live.listen(String, 'phase_traj/chain_code', LATCHED)
    live.until(lambda: texts)
    done = play(recording, '--rate', '2')
    assert (done.returncode, done.stderr, done.stdout) == (0, '', 'published 20 frames\n')
    live.until(lambda: texts[-1].data.startswith('frames 20;'))


def test_the_clock_is_left_to_others_unless_it_is_asked_for(live, recording):
    """The clock sets the time of every node with use_sim_time, also on a vehicle that drives."""
    live.start(lossless=False)
    texts = live.listen(String, 'phase_traj/chain_code', LATCHED)
    ticks = live.listen(Clock, '/clock', 100)
    live.until(lambda: texts)
    assert play(recording, '--rate', '2').returncode == 0
    live.until(lambda: texts[-1].data.startswith('frames 20;'))
    assert ticks == [] and live.node.count_publishers('/clock') == 0
    assert play(recording, '--rate', '1', '--clock', '100').returncode == 0
    live.until(lambda: texts[-1].data.startswith('frames 20;') and len(ticks) > 20)
    times = [each.clock.sec + each.clock.nanosec / 1e9 for each in ticks]
    assert times == sorted(times) and max(np.diff(times)) < 0.1


def test_where_nobody_subscribes_it_is_said(recording, domain):
    done = play(recording, '--rate', '1000', '--wait', '0.1')
    assert done.returncode == 0
    assert 'warning: no subscriber to /image with a matching quality of service' in done.stderr
    assert 'published 20 frames' in done.stdout


@pytest.mark.parametrize('topic', ['/front-camera/image_raw', 'bad topic', '/'])
def test_a_name_that_no_topic_can_have(recording, domain, topic):
    done = play(recording, '--image-topic', topic)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith(f"phase_traj: error: '{topic}': invalid topic name: ")
    assert len(done.stderr.splitlines()) == 1
