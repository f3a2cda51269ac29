# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Publishes frames at a given rate without losing any; started by node_throughput.py.

    python -m benchmarks.speed.node_feeder RATE COUNT --ros-args -r __ns:=NAMESPACE
"""

from __future__ import annotations

from collections.abc import Iterator
import sys

from benchmarks.shared.clips import rendered_clip
import numpy as np
from phase_traj_ros.io.sources.base import index_stamp_ns, StampedFrame
from phase_traj_ros.ros.playback.player import FramePlayer
from phase_traj_ros.ros.spin import ros_context
from phase_traj_ros.ros.startup.signals import stop_on_signals
from phase_traj_ros.synthetic import KITTI_CAMERA

_FRAMES = 20
_DISCOVERY_S = 30.0


def stamped(images: Iterator[np.ndarray], rate: float) -> Iterator[StampedFrame]:
    """Yield frames with stamps at ``rate`` per second, starting at one second."""
    for number, image in enumerate(images):
        yield StampedFrame(image, 10 ** 9 + index_stamp_ns(number, rate))


def main() -> None:
    """Run the program."""
    rate, count = float(sys.argv[1]), int(sys.argv[2])
    clip = rendered_clip(KITTI_CAMERA, count=_FRAMES)
    with stop_on_signals() as stop, ros_context(sys.argv[3:]):
        player = FramePlayer(lossless=True)
        player.wait_for_subscribers(stop, _DISCOVERY_S)
        player.play(stamped(clip.there_and_back(count), rate), stop)
        player.wait_for_acknowledgement()
        player.destroy_node()


if __name__ == '__main__':
    main()
