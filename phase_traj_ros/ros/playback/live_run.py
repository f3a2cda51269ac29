# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs a recording through the node, in a separate process and over DDS."""

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from phase_traj_ros.errors import SourceError
from phase_traj_ros.parameters import NODE_NAME, Parameters
from phase_traj_ros.ros.entities import LATCHED
from phase_traj_ros.ros.spin import ros_context
import rclpy
from std_msgs.msg import String

_DISCOVERY_S = 30.0
_SILENCE_S = 30.0
_STOP_S = 10.0
_PR_SET_PDEATHSIG = 1


def run_live(recording: Path, *, frames: int, values: Parameters, rate: float = 10.0) -> str:
    """
    Play ``recording`` to a node, both in separate processes; return its last ``~/chain_code``.

    No frame is lost: the images are reliable with KEEP_ALL at both ends. A separate namespace
    isolates the run from other nodes on the machine; other machines do not see it, unless the
    environment says otherwise.

    Parameters
    ----------
    recording
        Any source of frames.
    frames
        Number of frames to wait for.
    values
        Parameters of the node.
    rate
        Playback speed, relative to the recording.

    Raises
    ------
    SourceError
        A process fails or does not end, or no message arrives for some time.

    """
    namespace = f'/phase_traj_live_{os.getpid()}'
    within = ['-r', f'__ns:={namespace}']
    node = [
        'phase_traj_ros.ros.main', '--ros-args', *within,
        *(argument for spec in values.changed
          for argument in ('-p', f'{spec.name}:={json.dumps(values.value(spec))}')),
        *lossless_overrides(f'{namespace}/image')]
    player = [
        'phase_traj_ros.cli.main', 'play', str(recording), '--lossless', '--rate', str(rate),
        '--wait', str(_DISCOVERY_S), '--ros-args', *within]
    texts: list[str] = []
    # The player waits for the node, which would report missing images.
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    with (ros_context(['--ros-args', *within]),
            _process(player) as player_process, _process(node) as node_process):
        listener = rclpy.create_node(f'{NODE_NAME}_listener')

        def take(message: String) -> None:
            texts.append(message.data)

        listener.create_subscription(String, f'{NODE_NAME}/chain_code', take, LATCHED)
        try:
            seen, deadline = 0, time.monotonic() + _DISCOVERY_S + _SILENCE_S
            while not (texts and texts[-1].startswith(f'frames {frames};')):
                rclpy.spin_once(listener, timeout_sec=0.1)
                if node_process.poll() is not None:
                    raise SourceError(f'the node has exited with status {node_process.returncode}')
                if len(texts) > seen:
                    seen, deadline = len(texts), time.monotonic() + _SILENCE_S
                if time.monotonic() > deadline:
                    raise SourceError(
                        f'the node {namespace}/{NODE_NAME} does not respond, after'
                        f' {texts[-1] if texts else "no chain code"}')
            _wait_for(player_process, 'player')
        finally:
            listener.destroy_node()
        node_process.send_signal(signal.SIGINT)
        _wait_for(node_process, 'node')
        return texts[-1]


def lossless_overrides(topic: str) -> list[str]:
    """Return the ROS arguments that make a subscription to ``topic`` reliable and KEEP_ALL."""
    policies = {'reliability': 'reliable', 'history': 'keep_all'}
    return [
        argument for policy, value in policies.items()
        for argument in ('-p', f'qos_overrides.{topic}.subscription.{policy}:={value}')]


def start_child(arguments: list[str], **options: Any) -> 'subprocess.Popen[Any]':
    """
    Start a process as ``subprocess.Popen`` does; it dies with the calling thread.

    However the calling process ends, also killed, no node of its own remains on the network.
    """
    # Looked up here: between fork and exec, little is allowed.
    prctl = ctypes.CDLL(None).prctl
    return subprocess.Popen(
        arguments, preexec_fn=lambda: prctl(_PR_SET_PDEATHSIG, signal.SIGKILL), **options)


def _wait_for(process: 'subprocess.Popen[bytes]', name: str) -> None:
    """Wait until a process has ended; raise SourceError if it has not ended well."""
    try:
        status = process.wait(_STOP_S)
    except subprocess.TimeoutExpired:
        raise SourceError(f'the {name} has not ended within {_STOP_S:g} s') from None
    if status != 0:
        raise SourceError(f'the {name} has ended with status {status}')


@contextmanager
def _process(arguments: list[str]) -> Iterator['subprocess.Popen[bytes]']:
    """Run a module of this package in a process that ends with the block."""
    with start_child([sys.executable, '-m', *arguments], stdin=subprocess.DEVNULL,
                     stdout=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
