# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node, a managed (lifecycle) node."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, TYPE_CHECKING

from phase_traj_ros.errors import message_of, PhaseTrajError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.parameter_spec import Spec
from phase_traj_ros.parameters import NODE_NAME, Parameters
from phase_traj_ros.ros.nodes.bond import keep_bond
from phase_traj_ros.ros.nodes.live_parameters import declare, LiveParameters
from phase_traj_ros.ros.nodes.work import Work
from phase_traj_ros.ros.spin import names_explained
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

if TYPE_CHECKING:
    from phase_traj_ros.io.maps.road_file import RoadFile

_AUTOSTART = Spec(
    field='autostart', default=True, read_only=True,
    description='Whether the node configures and activates itself at its start.')


class PhaseTrajNode(LifecycleNode):
    """
    Processes images while it is active.

    When configured, it has its topics and services. When active, it receives images. Each
    activation starts a new drive, because the movement in the meantime is unknown.
    """

    def __init__(self) -> None:
        """
        Declare the parameters; configure and activate the node unless ``autostart`` is false.

        Raises
        ------
        ParameterError
            An initial value of a parameter is not allowed.
        OutputError
            With autostart: ``output_dir`` cannot be written.
        MissingDependencyError
            With autostart: a package that a parameter requires is not installed.

        """
        super().__init__(NODE_NAME, enable_logger_service=True)
        # Declaring a parameter is not a change, so there is no work yet.
        self._work: Work | None = None
        self.has_saved = True
        """Whether each drive ended by a cleanup, another mount or the node's end is saved."""
        self._failure: Exception | None = None
        self._bond = ExitStack()
        self._live = LiveParameters(self, check=self._check, on_change=self._change)
        # A transition that the state does not have ends the process of a plain LifecycleNode.
        self._change_state_of_rclpy = self._service_change_state.callback
        self._service_change_state.callback = self._on_change_state
        self._managed = not declare(self, _AUTOSTART)
        if self._managed:
            self.get_logger().info(
                f'unconfigured: ros2 lifecycle set {self.get_fully_qualified_name()} configure')
            return
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() is not TransitionCallbackReturn.SUCCESS:
                assert self._failure is not None
                raise self._failure

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make topics and services."""
        return self._attempt(self._configure, refusal=PhaseTrajError)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Reset the estimator and start to receive images."""
        return self._attempt(self._activate, refusal=PhaseTrajError)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop receiving images; late subscribers still receive the last latched messages."""
        return self._attempt(self._deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy topics and services; after an error, the node can be configured again."""
        return self._attempt(self._clean_up)

    on_shutdown = on_error = on_cleanup

    def destroy_node(self) -> None:
        """Destroy the node with its topics and services."""
        self._clean_up()
        super().destroy_node()

    def _configure(self) -> None:
        with names_explained():
            self._make_work(Mounting(self._live.values))

    def _make_work(self, mounting: Mounting, roads: RoadFile | None = None) -> Work:
        self._work = Work(self, mounting, on_other_mount=self._on_other_mount, roads=roads)
        return self._work

    def _on_other_mount(self) -> None:
        assert self.executor is not None
        # After the present callback, which is one of the work's.
        self.executor.create_task(self._restart)

    def _restart(self) -> None:
        """Start anew with the newest mount, unless that has no effect by now."""
        if self._work is None or self._state_machine.current_state[1] != 'active':
            return
        mounting = self._work.follow_mount()
        if mounting is not None:
            self.get_logger().info(str(mounting) or 'nothing is taken from /tf_static any more')
            # A map that was changed or removed since is read when the node is configured.
            roads = self._work.roads
            self._drop_work()
            self._make_work(mounting, roads).start()

    def _activate(self) -> None:
        assert self._work is not None
        with names_explained():
            self._work.start()
        if self._managed:
            self._bond.callback(keep_bond(self))
        self._live.tell()

    def _deactivate(self) -> None:
        assert self._work is not None
        self._bond.close()
        self._work.stop()

    def _clean_up(self) -> None:
        self._bond.close()
        self._drop_work()

    def _drop_work(self) -> None:
        if self._work is not None:
            self.has_saved &= self._work.close()
            self._work = None

    def _attempt(
        self, act: Callable[[], None], *, refusal: type[Exception] | tuple[()] = (),
    ) -> TransitionCallbackReturn:
        """
        Return what ``act`` means for the transition; rclpy would hide its exceptions.

        After a refusal the node stays in its state. After any other exception it cleans up.
        """
        try:
            act()
        except refusal as error:
            self._failure = error
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self._failure = error
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _on_change_state(self, request: Any, response: Any) -> Any:
        """Change the state as rclpy does, and log what came of it in one line."""
        before, self._failure = self._state_machine.current_state[1], None
        try:
            response = self._change_state_of_rclpy(request, response)
        except rclpy_implementation.RCLError:
            response.success = False
        now = self._state_machine.current_state[1]
        if response.success:
            self.get_logger().info(f'{before} -> {now}')
        elif self._failure is None:
            wanted = request.transition.label or request.transition.id
            self.get_logger().error(f'still {now}: there is no transition {wanted!r} from here')
        else:
            self.get_logger().error(f'{before} -> {now}: {message_of(self._failure)}')
        return response

    def _check(self, values: Parameters) -> None:
        if self._work is not None:
            self._work.check(values)

    def _change(self, values: Parameters) -> None:
        if self._work is not None:
            self._work.change(values)
