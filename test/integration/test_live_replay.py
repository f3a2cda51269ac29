# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The live node and the offline replay give the same codes."""

import json
import subprocess

import cv2
from live import LOSSLESS
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import Lens
from phase_traj_ros.core.codes.text import describe, parse_chain_code
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.messages.published import TEXT_RUNS
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import Selection
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.playback import live_run
from phase_traj_ros.ros.playback.live_run import run_live
import pytest
from std_msgs.msg import UInt8
from std_srvs.srv import Trigger


def replayed(path, threshold):
    parameters = Parameters().with_values({'threshold': threshold})
    with open_source(path) as source:
        return replay(source, parameters, source=source.description)


def check(path, threshold, rate):
    offline = replayed(path, threshold)
    online = run_live(
        path, frames=offline.frames, values=Parameters(threshold=threshold), rate=rate)
    assert parse_chain_code(online) == describe(
        offline.codes, frames=offline.frames, max_runs=TEXT_RUNS)
    return offline


@pytest.fixture
def folder(tmp_path):
    """Return a folder of 80 frames that swing from side to side, with a little noise."""
    rng = np.random.default_rng(3)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (120, 200), dtype=np.uint8), (0, 0), 2)
    texture = cv2.normalize(texture, None, 0, 255, cv2.NORM_MINMAX)
    position = np.cumsum(np.round(40 * np.sin(np.arange(80) / 6)).astype(int))
    for index, offset in enumerate(position):
        frame = np.roll(texture, offset, axis=1) + rng.normal(0, 3, texture.shape)
        cv2.imwrite(str(tmp_path / f'{index:04d}.png'), np.clip(frame, 0, 255).astype(np.uint8))
    return tmp_path


def test_a_folder_of_pictures(folder):
    offline = check(folder, 16.0, rate=8)
    assert {0, 1, 2, 3} == set(offline.movement)


def test_real_driving(kitti_root, tmp_path):
    # Into a turn and out of it.
    turn = slice(85, 135)
    for picture in sorted((kitti_root / '00' / 'image_0').iterdir())[turn]:
        (tmp_path / picture.name).symlink_to(picture)
    times = (kitti_root / '00' / 'times.txt').read_text().splitlines()[turn]
    (tmp_path / 'times.txt').write_text('\n'.join(times))
    offline = check(tmp_path, 20.0, rate=10)
    assert (offline.frames, set(offline.movement)) == (50, {1, 2, 3})


def test_the_command_gives_the_same(folder, tmp_path_factory, capfd):
    output = tmp_path_factory.mktemp('results')
    status = main(['replay', str(folder), '--output', str(output), '--threshold', '16'])
    assert (status, capfd.readouterr().err) == (0, '')
    written = json.loads((output / 'chain_code.json').read_text())
    assert written['movement'] == replayed(folder, 16.0).movement


def test_a_recording_that_knows_its_camera(live, kitti_root):
    parameters = Parameters(code_source='heading', connectivity=8)
    with open_source(kitti_root / '00', selection=Selection(start=9.0, duration=3.0)) as source:
        offline = replay(
            source, parameters, source='KITTI',
            lens=Lens(camera=source.camera(rectified=False)))
    node = live.start('-p', 'code_source:=heading', '-p', 'connectivity:=8')
    movement = live.listen(UInt8, 'phase_traj/movement', LOSSLESS)
    direction = live.listen(UInt8, 'phase_traj/direction', LOSSLESS)
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    # In a test it is known that both are there; the player itself waits for the images only.
    live.until(lambda: live.node.count_subscribers('/camera_info') == 1, process=node)
    assert not main([
        'play', str(kitti_root / '00'), '--start', '9', '--duration', '3', '--lossless',
        '--rate', '4'])
    live.until(lambda: len(movement) == len(offline.movement), process=node)
    live.until(lambda: len(direction) == len(offline.direction), process=node)
    assert [each.data for each in movement] == offline.movement
    assert [each.data for each in direction] == offline.direction
    assert len(set(offline.direction)) > 1


def test_lossless_play_needs_a_subscriber(folder, capfd):
    assert main(['play', str(folder), '--lossless', '--wait', '0.5']) == 2
    said = capfd.readouterr().err
    assert said.startswith('phase_traj: error: no subscriber to /image with a matching quality')
    assert said.count('\n') == 1


def test_a_process_that_does_not_end_is_an_error_in_one_line(monkeypatch):
    monkeypatch.setattr(live_run, '_STOP_S', 0.05)
    with subprocess.Popen(['sleep', '60']) as process:
        try:
            with pytest.raises(SourceError, match=r'^the player has not ended within 0\.05 s$'):
                live_run._wait_for(process, 'player')
        finally:
            process.kill()
