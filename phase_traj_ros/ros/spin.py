# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs a node until it is stopped.

The signal handlers of rclpy shut the context down while a callback is still running, which
sometimes ends in a traceback. Here a signal only sets an event (``stop_on_signals``): the running
callback finishes, and then the node is destroyed.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Event

from phase_traj_ros.errors import ParameterError
import rclpy
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

_POLL_S = 0.2


@contextmanager
def ros_context(arguments: Sequence[str] | None = None) -> Iterator[None]:
    """
    Initialise rclpy; shut it down on leaving.

    Raises
    ------
    ParameterError
        ROS cannot parse the arguments.

    """
    try:
        rclpy.init(
            args=None if arguments is None else list(arguments),
            signal_handler_options=SignalHandlerOptions.NO)
        yield
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        if rclpy.ok():
            raise
        # The rest of the message is the position in the C sources.
        reason = ' '.join(str(error).split(', at /')[0].split())
        raise ParameterError(f'{reason}: see the arguments after --ros-args') from None
    finally:
        rclpy.try_shutdown()


@contextmanager
def names_explained() -> Iterator[None]:
    """
    Report an invalid name of a node or a topic in one line.

    Raises
    ------
    ParameterError
        A name is invalid. It replaces the exception of rclpy, whose message has several lines.

    """
    try:
        yield
    except NameValidationException as error:
        # 'Invalid topic name: reason:', the name in quotes, and a pointer to the character.
        what, name, *_ = str(error).splitlines()
        raise ParameterError(f'{name.strip()}: {what.rstrip(":")[:1].lower()}'
                             f'{what.rstrip(":")[1:]}') from None


def spin(make_node: Callable[[], Node], stop: Event) -> None:
    """
    Make a node and run its callbacks until ``stop`` is set, then destroy it.

    Raises
    ------
    ParameterError
        The name of the node or of a topic is invalid.

    """
    with names_explained():
        node = make_node()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stop.is_set():
            executor.spin_once(timeout_sec=_POLL_S)
    finally:
        executor.shutdown()
        node.destroy_node()
