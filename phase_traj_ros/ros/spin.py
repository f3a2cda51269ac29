# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs a node until it is told to stop.

rclpy's own signal handlers shut the context down under a callback that is still running, which
then ends in a traceback now and then. Here a signal only sets an event; the callback under way
finishes, and the node is taken down in order.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import signal
from threading import Event

from phase_traj_ros.errors import ParameterError
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

_POLL_S = 0.2


@contextmanager
def ros_context(arguments: list[str] | None = None) -> Iterator[Event]:
    """
    Initialise rclpy; yield the event that SIGINT and SIGTERM set; shut down on leaving.

    Raises
    ------
    ParameterError
        ROS cannot make sense of the arguments.

    """
    stop = Event()
    handlers = {
        number: signal.signal(number, lambda *_: stop.set())
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        yield stop
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        if rclpy.ok():
            raise
        # What follows is where in the C sources it was noticed.
        reason = ' '.join(str(error).split(', at /')[0].split())
        raise ParameterError(f'{reason}: see the arguments behind --ros-args') from None
    finally:
        rclpy.try_shutdown()
        for number, handler in handlers.items():
            signal.signal(number, handler)


def spin(make_node: Callable[[], Node], stop: Event) -> None:
    """Make a node and run its callbacks until ``stop`` is set; then take it down."""
    node = make_node()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stop.is_set():
            executor.spin_once(timeout_sec=_POLL_S)
    finally:
        executor.shutdown()
        node.destroy_node()
