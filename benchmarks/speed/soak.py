# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Check that memory stays constant: 20,000 frames over DDS, 10 million updates of the state machine.

Run it by hand: python -m benchmarks.speed.soak
"""

import random
import subprocess
import sys
import time

from benchmarks.speed.memory import resident
import numpy as np
from phase_traj_ros.core import DynamicChainCode
from phase_traj_ros.io import StampedFrame
from phase_traj_ros.ros.playback.live_run import lossless_overrides
from phase_traj_ros.ros.playback.player import FramePlayer
from phase_traj_ros.ros.spin import ros_context
from phase_traj_ros.ros.startup.signals import stop_on_signals

_FRAMES = 20_000
_UPDATES = 10_000_000
_SHAPE = (376, 1241)
_RATE_HZ = 150.0


def soak_state_machine():
    """Feed the state machine shifts that flicker between all states."""
    generator = random.Random(0)
    shifts = [generator.uniform(-60, 60) for _ in range(10_007)]
    codes = DynamicChainCode(max_runs=100_000)
    for index in range(_UPDATES):
        codes.update(shifts[index % len(shifts)])
        if (index + 1) % (_UPDATES // 10) == 0:
            print(f'{index + 1:>9} updates: {resident() / 2**20:6.1f} MiB', flush=True)


def soak_node():
    """Play frames to the real node over DDS without a loss; watch its memory."""
    texture = np.random.default_rng(0).integers(0, 256, _SHAPE, dtype=np.uint8)
    frames = [np.roll(texture, 7 * index, axis=1) for index in range(50)]
    node = subprocess.Popen([
        sys.executable, '-m', 'phase_traj_ros.ros.main', '--ros-args',
        *lossless_overrides('/image')])
    with stop_on_signals() as stop, ros_context([]):
        player = FramePlayer(lossless=True)
        player.wait_for_subscribers(stop, 30.0)

        def stream():
            for index in range(_FRAMES):
                if index % (_FRAMES // 10) == 0:
                    print(f'{index:>9} frames: {resident(node.pid) / 2**20:6.1f} MiB', flush=True)
                yield StampedFrame(frames[index % len(frames)], index * 10**9)

        player.play(stream(), stop, rate=_RATE_HZ)
        player.wait_for_acknowledgement(stop)
        time.sleep(2)
        print(f'{_FRAMES:>9} frames: {resident(node.pid) / 2**20:6.1f} MiB')
        player.destroy_node()
    node.terminate()
    node.wait()


if __name__ == '__main__':
    soak_state_machine()
    soak_node()
