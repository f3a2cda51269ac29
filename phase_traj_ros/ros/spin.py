# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs a node until it is stopped.

The signal handlers of rclpy shut the context down while a callback is still running, which
sometimes ends in a traceback. Here a signal only sets an event (``stop_on_signals``): the running
callback finishes, and then the node is destroyed.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
import re
from threading import Event, Thread
from typing import TypeVar

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import check_syntax
import rclpy
from rclpy.exceptions import InvalidParameterTypeException, NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

AnyNode = TypeVar('AnyNode', bound=Node)

_POLL_S = 0.2
_PARAMS_FILE = 'params file'
_NO_LOG = 'failed to initialize logging: ', 'Failed opening file '
# What to write, by what rcl calls the argument.
_WRITE = {
    'remap rule': "write '-r FROM:=TO' with valid names, as in '-r image:=/camera/image_raw'",
    'parameter override rule': "write '-p NAME:=VALUE', as in '-p max_gap:=1.0'",
    'log level': 'give debug, info, warn, error or fatal, or LOGGER:=LEVEL',
    _PARAMS_FILE: '',
}


@contextmanager
def ros_context(arguments: Sequence[str]) -> Iterator[None]:
    """
    Initialise rclpy; shut it down on leaving.

    Raises
    ------
    ParameterError
        ROS cannot parse the arguments, or cannot make its log folder.

    """
    try:
        try:
            rclpy.init(args=list(arguments), signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:
            if rclpy.ok() and not any(reason in str(error) for reason in _NO_LOG):
                raise
            raise ParameterError(_explained(str(error))) from None
        yield
    finally:
        rclpy.try_shutdown()


def _explained(message: str) -> str:
    """Return what is wrong with the ROS arguments or the log folder, and what to do."""
    # The rest of the message is the position in the C sources.
    reason = ' '.join(message.split(', at /')[0].split())
    if reason.startswith(_NO_LOG):
        return (f'ROS cannot log: {reason.removeprefix(_NO_LOG[0])}: set ROS_LOG_DIR or HOME to a'
                ' folder that can be written')
    unknown = re.match(r"\['([^']*)'", reason)
    if unknown:
        return (f'{unknown[1]!r} is not a ROS argument: a topic is remapped by'
                " '-r FROM:=TO', a parameter is set by '-p NAME:=VALUE'")
    refused = re.search(r"parse (.+?): '-{1,2}\S+ (.*?)'\. Error", reason)
    if refused is None or refused[1] not in _WRITE:
        return f'{reason}: see the arguments after --ros-args'
    if refused[1] == _PARAMS_FILE:
        check_syntax(Path(refused[2]))
        reason = reason.partition('Error: ')[2]
        return f'{refused[2]} is not a ROS parameter file: {reason}'
    return f'the {refused[1]} {refused[2]!r} is not valid: {_WRITE[refused[1]]}'


@contextmanager
def names_explained() -> Iterator[None]:
    """
    Report an invalid name of a node or a topic, or an invalid ``use_sim_time``, in one line.

    Raises
    ------
    ParameterError
        A name is invalid, or a parameter of rclpy has the wrong type. It replaces the exception of
        rclpy.

    """
    try:
        yield
    except InvalidParameterTypeException as error:
        raise ParameterError(str(error)) from None
    except NameValidationException as error:
        # 'Invalid topic name: reason:', the name in quotes, and a pointer to the character.
        what, name, *_ = str(error).splitlines()
        raise ParameterError(f'{name.strip()}: {what.rstrip(":")[:1].lower()}'
                             f'{what.rstrip(":")[1:]}') from None


def spin(make_node: Callable[[], AnyNode], stop: Event) -> AnyNode:
    """
    Make a node, run its callbacks until ``stop`` is set, destroy it, and return it.

    Raises
    ------
    ParameterError
        The name of the node or of a topic is invalid.

    """
    with names_explained():
        node = make_node()
    try:
        _run_callbacks(node, stop)
    finally:
        node.destroy_node()
    return node


@contextmanager
def spinning(node: Node) -> Iterator[None]:
    """
    Run the callbacks of a node in a thread, and destroy it on leaving.

    A node whose services never answer blocks ``ros2 param list`` of the whole system.
    """
    left = Event()
    thread = Thread(target=_run_callbacks, args=(node, left))
    thread.start()
    try:
        yield
    finally:
        left.set()
        thread.join()
        node.destroy_node()


def _run_callbacks(node: Node, stop: Event) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stop.is_set():
            # A transition may destroy a service that has yet to respond, such as ~/save.
            with suppress(rclpy_implementation.InvalidHandle):
                executor.spin_once(timeout_sec=_POLL_S)
    finally:
        executor.shutdown()
