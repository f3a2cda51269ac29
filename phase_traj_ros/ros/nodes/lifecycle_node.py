# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node as a managed (lifecycle) node."""

from phase_traj_ros.errors import PhaseTrajError
from phase_traj_ros.parameters import NODE_NAME, Parameters
from phase_traj_ros.ros.nodes.live_parameters import LiveParameters
from phase_traj_ros.ros.nodes.work import Work
from phase_traj_ros.ros.spin import names_explained
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn


class PhaseTrajLifecycleNode(LifecycleNode):
    """
    Works like ``PhaseTrajNode`` while it is active.

    When configured, it has its topics and services. When active, it receives images. Each
    activation resets the estimator, because the movement in the meantime is unknown.
    """

    def __init__(self) -> None:
        """
        Declare the parameters.

        Raises
        ------
        ParameterError
            An initial value of a parameter is not allowed.

        """
        super().__init__(NODE_NAME, enable_logger_service=True)
        self._work: Work | None = None
        self._live = LiveParameters(self, check=self._check, on_change=self._change)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make topics and services; on an error, log it and refuse the transition."""
        try:
            with names_explained():
                self._work = Work(self, self._live.values)
        except PhaseTrajError as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Reset the estimator and start to receive images."""
        assert self._work is not None
        self._work.restart()
        try:
            with names_explained():
                self._work.start()
        except PhaseTrajError as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        self._live.tell()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop receiving images; late subscribers still receive the last latched messages."""
        assert self._work is not None
        self._work.stop()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy topics and services."""
        self._take_down()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy topics and services, in any state."""
        self._take_down()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy topics and services, so that the node can be configured again."""
        self._take_down()
        return TransitionCallbackReturn.SUCCESS

    def destroy_node(self) -> None:
        """Destroy the node with its topics and services."""
        self._take_down()
        super().destroy_node()

    def _take_down(self) -> None:
        if self._work is not None:
            self._work.stop()
            self._work.close()
            self._work = None

    def _check(self, values: Parameters) -> None:
        if self._work is not None:
            self._work.check(values)

    def _change(self, values: Parameters) -> None:
        if self._work is not None:
            self._work.change(values)
