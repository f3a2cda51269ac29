# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Throughput of the real node over DDS: frames per second, and the cost of a frame.

There are three processes: the feeder, the node, and this one, which counts the movement codes that
come back. Images and codes are reliable with KEEP_ALL at both ends, so none may be lost. A frame
whose code never arrives counts as lost.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import os
from pathlib import Path
from statistics import median
import subprocess
import sys
import time

from benchmarks.shared.report import disturbance, paragraphs, ROOT, table, verdict
from benchmarks.shared.timing import Bystanders, bystanders, unpinned
from benchmarks.speed.node_feeder import CLIPS
import numpy as np
from phase_traj_ros.io.params_file import read_parameters
from phase_traj_ros.io.replay.estimator import make_estimator
from phase_traj_ros.io.sources.base import index_stamp_ns
from phase_traj_ros.parameters import NODE_NAME, Parameters
from phase_traj_ros.ros.playback.live_run import lossless_overrides
from phase_traj_ros.ros.playback.player import LOSSLESS
from phase_traj_ros.ros.spin import ros_context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import UInt8
from std_srvs.srv import Trigger

_EVERYTHING = {'camera_height': 1.65, 'code_step': 5.0}
_FAST = ((60.0, 600), (150.0, 1200), (300.0, 1800))
_LEAST_RATE = 150.0
_MORE_MS = 2.1
_ROUNDS = 3
_DISCOVERY_S, _SILENCE_S, _STOP_S = 30.0, 8.0, 10.0
_ASK_AGAIN_S = 2.0
_TICK_S = 1.0 / os.sysconf('SC_CLK_TCK')

INTRODUCTION = paragraphs("""
    The node runs in its own process. A second process feeds it over DDS, and a third counts its
    codes: mono8, 376×1241, images and codes reliable with KEEP_ALL at both ends, all on one
    machine. *Came back* is the rate of the movement codes received; *lost* is the number that
    never arrived. The processor time is that of the node's whole process per frame, including DDS
    and the executor. The allocator is not pinned, as in normal use.
    """)


AT_A_CAMERAS_RATE = paragraphs(f"""
    At a camera's rate caches and clocks cool down between two frames. The frames are those of a
    rendered drive with a turn. *Everything on* is an unknown camera that is learned, metres by the
    height of the camera, and equal links. *Alone* is the estimator by itself, in this process,
    with the same pauses. Node and estimator take turns, {_ROUNDS} times; the times are the medians
    of processor time per frame.
    """)


@dataclass(frozen=True, slots=True)
class Configuration:
    """A camera and the parameters of the node."""

    name: str
    clip: str
    rate: float
    frames: int
    parameters: Parameters
    arguments: Sequence[str]
    """Arguments of the node that give these parameters."""
    limit_ms: float | None
    """What a frame may take in the node at most, if there is such an aim."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What a frame costs at a camera's rate, in milliseconds of processor time."""

    of: Configuration
    node_ms: float
    """The node's whole process."""
    alone_ms: float
    """The estimator by itself."""


@dataclass(frozen=True, slots=True)
class Run:
    """Result of feeding the node at one rate."""

    asked: float
    """Frames per second requested from the feeder."""
    sent: int
    received: int
    """Movement codes received: one less than frames if none is lost."""
    rate: float
    """Movement codes per second."""
    node_ms: float
    """Processor time of the node per frame, in milliseconds."""

    @property
    def lost(self) -> int:
        """Return the number of pairs without a code."""
        return self.sent - 1 - self.received


class Counter(Node):
    """Counts the movement codes of the node in the same namespace."""

    def __init__(self) -> None:
        super().__init__('counter')
        self.times: list[float] = []
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self.create_subscription(UInt8, f'{NODE_NAME}/movement', self._count, LOSSLESS)
        # Created after the subscription: the node can answer only clients that it has discovered,
        # and it discovers both in this order.
        self._reset = self.create_client(Trigger, f'{NODE_NAME}/reset')

    def connect(self) -> None:
        """Wait until the node has discovered this subscription."""
        if not self._reset.wait_for_service(_DISCOVERY_S):
            raise TimeoutError('the node does not start')
        deadline = time.monotonic() + _DISCOVERY_S
        while time.monotonic() < deadline:
            # An answer is lost if the node receives the call before it has discovered the client.
            answer = self._reset.call_async(Trigger.Request())
            self._executor.spin_until_future_complete(answer, _ASK_AGAIN_S)
            if answer.done():
                return
            self._reset.remove_pending_request(answer)
        raise TimeoutError('the node does not answer')

    def wait_for(self, count: int) -> None:
        """Wait until that many codes have arrived in total, or none for some time."""
        seen, quiet_since = -1, 0.0
        while len(self.times) < count:
            # The feeder has to start first.
            patience = _SILENCE_S if self.times else _DISCOVERY_S
            if len(self.times) != seen:
                seen, quiet_since = len(self.times), time.monotonic()
            elif time.monotonic() > quiet_since + patience:
                return
            self._executor.spin_once(timeout_sec=0.1)

    def destroy_node(self) -> None:
        """Destroy what was created."""
        self._executor.shutdown()
        super().destroy_node()

    def _count(self, _: UInt8) -> None:
        self.times.append(time.monotonic())


def processor_time(pid: int) -> float:
    """Return the processor time of a process in seconds, including all threads."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICK_S


@contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run Python in a separate process, which ends with the block."""
    running = subprocess.Popen(
        [sys.executable, *arguments], env=unpinned(), stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL)
    try:
        yield running
    finally:
        running.terminate()
        try:
            running.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()


def feed(
    rate: float, count: int, arguments: Sequence[str] = (), *, clip: str = 'flicker',
) -> Run:
    """
    Feed a node ``count`` frames at ``rate`` per second; return the result.

    ``arguments`` are for ROS, such as a parameter file; ``clip`` is the name of the frames.
    """
    namespace = f'/phase_traj_bench_{os.getpid()}'
    within = ['--ros-args', '-r', f'__ns:={namespace}']
    # The codes must not be lost either if this process counts too slowly.
    codes = f'qos_overrides.{namespace}/{NODE_NAME}/movement.publisher.history:=keep_all'
    warm_up = count // 5
    with (ros_context(within),
          process('-m', 'phase_traj_ros.ros.main', *within, '--log-level', 'error',
                  '-p', codes, *lossless_overrides(f'{namespace}/image'), *arguments) as node):
        counter = Counter()
        try:
            counter.connect()
            with process('-m', 'benchmarks.speed.node_feeder', str(rate), str(count), clip,
                         *within):
                counter.wait_for(warm_up)
                began = processor_time(node.pid)
                counter.wait_for(count - 1)
                used = processor_time(node.pid) - began
                times = counter.times
        finally:
            counter.destroy_node()
    timed = len(times) - warm_up
    return Run(
        rate, count, len(times), timed / (times[-1] - times[warm_up - 1]), 1e3 * used / timed)


def estimator_ms(configuration: Configuration, images: list[np.ndarray]) -> float:
    """Return the processor time of the estimator alone, per frame, at the camera's rate."""
    estimator = make_estimator(configuration.parameters)
    took = []
    for index, image in enumerate(images):
        time.sleep(1.0 / configuration.rate)
        began = time.thread_time()
        estimator.update(image, index_stamp_ns(index, configuration.rate))
        took.append(time.thread_time() - began)
    timed = took[len(took) // 5:]
    return 1e3 * sum(timed) / len(timed)


def configurations() -> list[Configuration]:
    """Return what is measured at a camera's rate."""
    paper = ROOT / 'config' / 'paper.yaml'
    given = [part for name, value in _EVERYTHING.items()
             for part in ('-p', f'{name}:={str(value).lower()}')]
    everything = Parameters(**_EVERYTHING)
    return [
        Configuration('`config/paper.yaml`, 376×1241 at 10 Hz', 'kitti', 10.0, 100,
                      read_parameters(paper), ('--params-file', str(paper)), None),
        Configuration('all defaults, 376×1241 at 10 Hz', 'kitti', 10.0, 100, Parameters(), (),
                      None),
        Configuration('everything on, 376×1241 at 10 Hz', 'kitti', 10.0, 100, everything, given,
                      4.0),
        Configuration('everything on, 1080×1920 at 30 Hz', '1080p', 30.0, 180, everything, given,
                      8.0),
    ]


def measure_costs() -> tuple[list[Cost], Bystanders]:
    """Return the cost of a frame at a camera's rate, and the load of other programs."""
    costs: list[Cost] = []
    seen: list[Bystanders] = []
    for each in configurations():
        node, alone = [], []
        for _ in range(_ROUNDS):
            node.append(feed(each.rate, each.frames, each.arguments, clip=each.clip).node_ms)
            images = CLIPS[each.clip](each.rate, each.frames)
            # Only now: the node and its feeder are gone, and would not be bystanders.
            with bystanders() as watched:
                alone.append(estimator_ms(each, images))
            seen.append(watched)
        costs.append(Cost(each, median(node), median(alone)))
    return costs, max(seen, key=lambda each: each.cores or 0.0)


def measure() -> tuple[list[Run], list[Cost], Bystanders]:
    """Return the results at high rates, the cost of a frame at a camera's rate, the other load."""
    # Other robots on the network have nothing to do with this.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    return [feed(*each) for each in _FAST], *measure_costs()


def section(runs: list[Run], costs: list[Cost], watched: Bystanders) -> str:
    """Return the results as Markdown."""
    rows = [(f'{run.asked:g}', run.sent, f'{run.rate:.0f}', run.lost, f'{run.node_ms:.1f}')
            for run in runs]
    lossless = [run.rate for run in runs if run.lost == 0]
    best = max(lossless, default=0.0)
    met = 'met' if best >= 0.99 * _LEAST_RATE else '**not met**'
    header = ('frames/s asked', 'sent', 'came back, /s', 'lost', 'node, ms of processor per frame')
    cost_rows = []
    for cost in costs:
        more, limit = cost.node_ms - cost.alone_ms, cost.of.limit_ms
        cost_rows.append((
            cost.of.name, f'{cost.node_ms:.2f}', '' if limit is None else f'{limit:g}',
            verdict(cost.node_ms, limit), f'{cost.alone_ms:.2f}', f'{more:.2f}',
            f'{_MORE_MS:g}', verdict(more, _MORE_MS)))
    cost_header = (
        'configuration', 'node, ms', 'at most', 'met', 'alone, ms', 'more, ms', 'at most', 'met')
    return (f'## The node\n\n{INTRODUCTION}\n\n{table(header, rows)}\n\n'
            f'{best:.0f} frames/s without a loss; the aim of {_LEAST_RATE:g} is {met}.\n\n'
            f'{AT_A_CAMERAS_RATE}\n\n{table(cost_header, cost_rows)}\n\n{disturbance(watched)}')


if __name__ == '__main__':
    print(section(*measure()))
