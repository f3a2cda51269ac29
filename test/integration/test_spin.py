# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The loop that runs a node."""

from threading import Event

from phase_traj_ros.ros.spin import ros_context, spin
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger


class Busy(Node):
    """Destroys its service before it responds, as a transition does during a save."""

    def __init__(self, stop):
        super().__init__('busy')
        self._stop = stop
        self._service = self.create_service(Trigger, '~/work', self._on_work)
        self._client = self.create_client(Trigger, '~/work')
        self._timer = self.create_timer(0.02, self._ask)

    def _ask(self):
        if self._client.service_is_ready():
            self._timer.cancel()
            self._client.call_async(Trigger.Request())

    async def _on_work(self, request, response):
        done = Future(executor=self.executor)

        def end():
            self.destroy_service(self._service)
            done.set_result(None)
            self.create_timer(0.1, self._stop.set)

        self.executor.create_task(end)
        await done
        return response


def test_a_service_that_is_destroyed_before_it_responds_does_not_end_the_process(domain):
    stop = Event()
    with ros_context([]):
        spin(lambda: Busy(stop), stop)
    assert stop.is_set()
