# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Records the messages of the node."""

from collections.abc import Callable
import time
from typing import Any

from geometry_msgs.msg import PoseStamped, Vector3Stamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nav_msgs.msg import Path
from phase_traj_ros.errors import SourceError
from phase_traj_ros.parameters import NODE_NAME
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float32, String, UInt8
from std_srvs.srv import Trigger

_EVERYTHING = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, depth=1, reliability=ReliabilityPolicy.RELIABLE)
_ASK_AGAIN_S = 2.0
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Recorder(Node):
    """Subscribes to the topics of a ``phase_traj`` node in the same namespace."""

    def __init__(self) -> None:
        """Make the subscriptions."""
        super().__init__(f'{NODE_NAME}_recorder')
        self.movement: list[int] = []
        self.direction: list[int] = []
        self.shifts: list[Vector3Stamped] = []
        self.responses: list[float] = []
        self.poses: list[PoseStamped] = []
        self.chain_code: list[str] = []
        self.paths: list[Path] = []
        self._take(UInt8, 'movement', lambda message: self.movement.append(message.data))
        self._take(UInt8, 'direction', lambda message: self.direction.append(message.data))
        self._take(Vector3Stamped, 'shift', self.shifts.append)
        self._take(Float32, 'response', lambda message: self.responses.append(message.data))
        self._take(PoseStamped, 'pose', self.poses.append)
        self._take(
            String, 'chain_code', lambda message: self.chain_code.append(message.data), _LATCHED)
        self._take(Path, 'path', self.paths.append, _LATCHED)
        # Made after the subscriptions; see ``connect``.
        self._change = self.create_client(ChangeState, f'{NODE_NAME}/change_state')
        self._reset = self.create_client(Trigger, f'{NODE_NAME}/reset')

    def connect(self, spin_once: Callable[[], None], timeout_s: float) -> None:
        """
        Configure and activate the node; it knows this recorder before it receives an image.

        Discovery announces endpoints in the order in which they were made. The node can only
        respond to a client that it knows, so its response proves that it also knows the
        subscriptions made before the client.

        Raises
        ------
        SourceError
            The node does not respond within ``timeout_s`` seconds.

        """
        deadline = time.monotonic() + timeout_s
        self._ask(self._change, _transition('configure'), spin_once, deadline)
        self._ask(self._reset, Trigger.Request(), spin_once, deadline)
        self.chain_code.clear()
        self.paths.clear()
        self._ask(self._change, _transition('activate'), spin_once, deadline)

    def _ask(
        self, client: Client, request: Any, spin_once: Callable[[], None], deadline: float,
    ) -> None:
        """Call a service until it responds; a repeated transition changes nothing."""
        while not client.service_is_ready():
            self._wait(spin_once, deadline)
        # A response is lost if the node receives the request before it discovers the client.
        answer, asked = client.call_async(request), time.monotonic()
        while not answer.done():
            if time.monotonic() > asked + _ASK_AGAIN_S:
                client.remove_pending_request(answer)
                answer, asked = client.call_async(request), time.monotonic()
            self._wait(spin_once, deadline)

    def wait_for_pairs(
        self, count: int, spin_once: Callable[[], None], timeout_s: float,
    ) -> None:
        """
        Return when all messages of ``count`` pairs of frames have arrived.

        Raises
        ------
        SourceError
            No new message has arrived for ``timeout_s`` seconds.

        """
        seen, deadline = -1, 0.0
        while not self._has(count):
            if len(self.poses) != seen:
                seen, deadline = len(self.poses), time.monotonic() + timeout_s
            self._wait(spin_once, deadline)

    def _has(self, pairs: int) -> bool:
        directions = sum(code != 3 for code in self.movement)
        complete = (self.movement, self.shifts, self.responses, self.poses)
        return (
            all(len(each) >= pairs for each in complete) and len(self.direction) >= directions
            and bool(self.paths) and self.paths[-1].header.stamp == self.poses[-1].header.stamp
            and self.chain_code[-1].startswith(f'frames {pairs + 1};'))

    def _wait(self, spin_once: Callable[[], None], deadline: float) -> None:
        if time.monotonic() > deadline:
            raise SourceError(
                f'the node {self.get_namespace().rstrip("/")}/{NODE_NAME} does not respond, after'
                f' {len(self.movement)} movement codes')
        spin_once()

    def _take(
        self, kind: type, topic: str, callback: Callable[[Any], None],
        qos: QoSProfile = _EVERYTHING,
    ) -> None:
        self.create_subscription(kind, f'{NODE_NAME}/{topic}', callback, qos)


def _transition(label: str) -> Any:
    return ChangeState.Request(transition=Transition(label=label))
