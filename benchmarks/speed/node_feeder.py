# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Publishes frames at a given rate without losing any; started by node_throughput.py.

    python -m benchmarks.speed.node_feeder RATE COUNT CLIP --ros-args -r __ns:=NAMESPACE
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
import sys

from benchmarks.shared.clips import rendered_clip
import numpy as np
from phase_traj_ros.io.sources.base import index_stamp_ns, StampedFrame
from phase_traj_ros.ros.playback.player import FramePlayer
from phase_traj_ros.ros.spin import ros_context
from phase_traj_ros.ros.startup.signals import stop_on_signals
from phase_traj_ros.synthetic import (
    Camera,
    KITTI_CAMERA,
    plan_drive,
    render_drive,
    Straight,
    Turn,
)

_FRAMES = 20
_DISCOVERY_S = 30.0


def _drive(camera: Camera, rate: float, count: int) -> list[np.ndarray]:
    drive = plan_drive(
        '', [Straight(1.5), Turn(90, 3.0, 5.0), Straight(count / rate)], rate_hz=rate, speed=9.0,
        camera=camera, seed=3)
    return list(islice(render_drive(drive), count))


def _flicker(_: float, count: int) -> list[np.ndarray]:
    return list(rendered_clip(KITTI_CAMERA, count=_FRAMES).there_and_back(count))


CLIPS: dict[str, Callable[[float, int], list[np.ndarray]]] = {
    'flicker': _flicker,
    'kitti': lambda rate, count: _drive(KITTI_CAMERA, rate, count),
    '1080p': lambda rate, count: _drive(
        Camera.with_field_of_view(1920, 1080, 70), rate, count),
}
"""Frames by the name of what they show, given their rate and number."""


def stamped(images: list[np.ndarray], rate: float) -> Iterator[StampedFrame]:
    """Yield frames with stamps at ``rate`` per second, starting at one second."""
    for number, image in enumerate(images):
        yield StampedFrame(image, 10 ** 9 + index_stamp_ns(number, rate))


def main() -> None:
    """Run the program."""
    rate, count = float(sys.argv[1]), int(sys.argv[2])
    images = CLIPS[sys.argv[3]](rate, count)
    with stop_on_signals() as stop, ros_context(sys.argv[4:]):
        player = FramePlayer(lossless=True)
        player.wait_for_subscribers(stop, _DISCOVERY_S)
        player.play(stamped(images, rate), stop)
        player.wait_for_acknowledgement(stop)
        player.destroy_node()


if __name__ == '__main__':
    main()
