# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs a recording through the node, in a separate process and over DDS."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import json
import os
from pathlib import Path
import signal
import subprocess
import sys

from phase_traj_ros.errors import SourceError
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.playback.children import start_child
from phase_traj_ros.ros.playback.recorder import Recorder
from phase_traj_ros.ros.spin import ros_context
from phase_traj_ros.ros.startup.signals import stop_on_signals
from rclpy.executors import SingleThreadedExecutor

_DISCOVERY_S = 30.0
_SILENCE_S = 20.0
_STOP_S = 10.0
_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


@dataclass(frozen=True, slots=True)
class LiveResult:
    """Messages that the node has published for a recording."""

    movement: tuple[int, ...]
    direction: tuple[int, ...]
    chain_code: str
    """The last text."""
    path_poses: int
    """Number of poses of the last path."""
    exit_status: int
    """Exit status of the node after SIGINT."""


def run_live(
    recording: Path, *, pairs: int, values: Parameters, rate: float = 10.0,
) -> LiveResult:
    """
    Play ``recording`` to a node, both in separate processes; record the messages of the node.

    No frame is lost: the images are reliable with KEEP_ALL at both ends. A separate namespace
    isolates the run from other nodes on the machine; other machines do not see it.

    Parameters
    ----------
    recording
        Any source of frames.
    pairs
        Number of pairs of frames to wait for.
    values
        Parameters of the node.
    rate
        Playback speed, relative to the recording.

    Raises
    ------
    SourceError
        A process fails, or no message arrives for some time.

    """
    namespace = f'/phase_traj_live_{os.getpid()}'
    within = ['-r', f'__ns:={namespace}']
    node = [
        'phase_traj_ros.ros.lifecycle_main', '--ros-args', *within,
        *(argument for spec in values.changed
          for argument in ('-p', f'{spec.name}:={json.dumps(values.value(spec))}')),
        *lossless_overrides(f'{namespace}/image')]
    player = [
        'phase_traj_ros.cli.main', 'play', str(recording), '--lossless', '--rate', str(rate),
        '--wait', str(_DISCOVERY_S), '--ros-args', *within]
    with (stop_on_signals() as stop, _on_this_machine(),
            ros_context(['--ros-args', *within]),
            _process(node) as node_process, _process(player) as player_process):
        recorder = Recorder()
        executor = SingleThreadedExecutor()
        executor.add_node(recorder)

        def spin_once() -> None:
            executor.spin_once(timeout_sec=0.1)
            if stop.is_set():
                raise KeyboardInterrupt
            if node_process.poll() is not None:
                raise SourceError(f'the node has exited with status {node_process.returncode}')

        try:
            # The player waits for the node, which subscribes to the images when it is active.
            recorder.connect(spin_once, _DISCOVERY_S)
            recorder.wait_for_pairs(pairs, spin_once, _DISCOVERY_S + _SILENCE_S)
            if player_process.wait(_STOP_S) != 0:
                raise SourceError('the player has failed')
        finally:
            executor.shutdown()
            recorder.destroy_node()
        node_process.send_signal(signal.SIGINT)
        return LiveResult(
            tuple(recorder.movement), tuple(recorder.direction), recorder.chain_code[-1],
            len(recorder.paths[-1].poses), node_process.wait(_STOP_S))


def lossless_overrides(topic: str) -> list[str]:
    """Return the ROS arguments that make a subscription to ``topic`` reliable and KEEP_ALL."""
    policies = {'reliability': 'reliable', 'history': 'keep_all'}
    return [
        argument for policy, value in policies.items()
        for argument in ('-p', f'qos_overrides.{topic}.subscription.{policy}:={value}')]


@contextmanager
def _on_this_machine() -> Iterator[None]:
    """Keep the topics from other machines, unless the environment says otherwise."""
    if _RANGE in os.environ:
        yield
        return
    os.environ[_RANGE] = 'LOCALHOST'
    try:
        yield
    finally:
        del os.environ[_RANGE]


@contextmanager
def _process(arguments: list[str]) -> Iterator['subprocess.Popen[bytes]']:
    """Run a module of this package in a process that ends with the block."""
    process = start_child(
        [sys.executable, '-m', *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
