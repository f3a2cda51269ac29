# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The test's side of a live run: a node of its own beside the one under test."""

from array import array
import signal
import subprocess
import sys
import time

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import numpy as np
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.ros.playback.live_run import lossless_overrides, start_child
from rcl_interfaces.srv import DescribeParameters, ListParameters, SetParameters
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image

LOSSLESS = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, depth=1, reliability=ReliabilityPolicy.RELIABLE)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Only a test that hangs waits for so long.
TIMEOUT_S = 120
# What is rolled has shifts and does not turn: tests of shifts and of the paper's codes.
SHIFT = ('-p', 'code_source:=shift')


class Live:
    """Starts the node under test, feeds it and listens to it."""

    def __init__(self, folder, *, lock=None):
        """Keep logs in ``folder``; the nodes hold ``lock``, an open file, while they live."""
        self._folder = folder
        self._held = [] if lock is None else [lock.fileno()]
        self._processes = []
        self._clients = {}

    def __enter__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node('test', context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        return self

    def __exit__(self, *_):
        # A node that is killed leaves its shared memory; the participant here also has to deal
        # with a peer that is gone without a word.
        for process in self._processes:
            process.terminate()
        for process in self._processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def start(
            self, *ros_arguments, lossless=True, module='phase_traj_ros.ros.main', arguments=None):
        """Start a node; its log goes to a file. ``arguments`` are instead of those for ROS."""
        overrides = lossless_overrides('/image') if lossless else []
        log = self._folder / f'node{len(self._processes)}.log'
        with log.open('wb') as file:
            process = start_child(
                [sys.executable, '-m', module,
                 *(arguments or ['--ros-args', *overrides, *ros_arguments])],
                stdout=file, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                pass_fds=self._held)
        process.log = log
        self._processes.append(process)
        return process

    def until(self, condition, *, process=None):
        """Handle what comes until the condition holds."""
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert time.monotonic() < deadline, 'timed out; the log says:\n' + self.logs()
            assert process is None or process.poll() is None, self.logs()
            self.executor.spin_once(timeout_sec=0.05)

    def until_said(self, *texts, process=None):
        """Handle what comes until the log has each text, whatever their order."""
        def all_said():
            log = self.logs()
            return all(text in log for text in texts)

        self.until(all_said, process=process)

    def spin(self, seconds):
        """Handle what comes for some time."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def logs(self):
        """Return what all nodes started so far have logged."""
        return '\n'.join(process.log.read_text() for process in self._processes)

    def listen(self, kind, topic, qos=LOSSLESS):
        """Return a list that the messages on a topic are appended to."""
        received = []
        self.node.create_subscription(kind, topic, received.append, qos)
        return received

    def camera(self, topic='image', qos=LOSSLESS, *, kind=Image):
        """Return a publisher of images that the node under test has subscribed to."""
        publisher = self.node.create_publisher(kind, topic, qos)
        self.until(lambda: publisher.get_subscription_count() > 0)
        return publisher

    def call(self, kind, service, request):
        """Call a service and return its answer."""
        client = self._clients.get(service)
        # Most calls do no harm if they come twice.
        harmless = not service.endswith(('/save', '/change_state'))
        again_s = 3.0 if harmless else 10.0
        if client is None:
            client = self._clients[service] = self.node.create_client(kind, service)
            self.until(client.service_is_ready)
            # An answer is lost if the server sees the call before it sees who calls.
            self.spin(0.1)
            again_s = 0.5 if harmless else again_s
        # Of a busy node, the answer to an earlier call counts as well.
        answers = []
        for _ in range(10):
            answers.append(client.call_async(request))
            asked = time.monotonic()
            while time.monotonic() < asked + again_s:
                self.executor.spin_once(timeout_sec=0.05)
                for answer in answers:
                    if answer.done():
                        return answer.result()
            again_s = max(again_s, 3.0)
        raise AssertionError(f'no answer from {service}')

    def change_state(self, transition):
        """Ask the node under test for a transition; return whether it was made."""
        request = ChangeState.Request(transition=Transition(id=transition))
        return self.call(ChangeState, '/phase_traj/change_state', request).success

    def set_parameter(self, name, value):
        """Set one parameter of the node under test; return the result."""
        request = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()])
        return self.call(SetParameters, '/phase_traj/set_parameters', request).results[0]

    def describe_parameters(self):
        """Return the descriptors of all parameters of the node under test."""
        names = self.call(
            ListParameters, '/phase_traj/list_parameters', ListParameters.Request()).result.names
        return self.call(
            DescribeParameters, '/phase_traj/describe_parameters',
            DescribeParameters.Request(names=names)).descriptors


def stop(process, number=signal.SIGINT):
    """Signal a process and return its exit status."""
    process.send_signal(number)
    return process.wait(TIMEOUT_S)


def image(data, stamp_ns, encoding='mono8', *, shape=None, step=None, is_bigendian=False):
    """Return an image message; data is an array, or bytes with a shape (height, width)."""
    if isinstance(data, np.ndarray):
        shape = data.shape[:2]
        step = step or data.strides[0]
        data = data.tobytes()
    message = Image(
        height=shape[0], width=shape[1], encoding=encoding, step=step,
        is_bigendian=int(is_bigendian), data=array('B', data))
    message.header.stamp = MESSAGES.time(stamp_ns)
    message.header.frame_id = 'camera'
    return message
