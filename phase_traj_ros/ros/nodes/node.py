# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node."""

from phase_traj_ros.parameters import NODE_NAME, Parameters
from phase_traj_ros.ros.nodes.live_parameters import LiveParameters
from phase_traj_ros.ros.nodes.work import Work
from rclpy.node import Node


class PhaseTrajNode(Node):
    """Processes images from its start to its end."""

    def __init__(self) -> None:
        """
        Declare the parameters and start to receive images.

        Raises
        ------
        ParameterError
            An initial value of a parameter is not allowed.
        OutputError
            ``record_shifts`` is set, and the file cannot be written.
        MissingDependencyError
            A package that a parameter requires is not installed.

        """
        super().__init__(NODE_NAME, enable_logger_service=True)
        # Declaring a parameter is not a change, so there is no work yet.
        self._work: Work | None = None
        self._live = LiveParameters(self, check=self._check, on_change=self._change)
        self._work = Work(self, self._live.values)
        self._work.start()
        self._live.tell()

    def destroy_node(self) -> None:
        """Destroy the node."""
        if self._work is not None:
            self._work.close()
        super().destroy_node()

    def _check(self, values: Parameters) -> None:
        if self._work is not None:
            self._work.check(values)

    def _change(self, values: Parameters) -> None:
        if self._work is not None:
            self._work.change(values)
