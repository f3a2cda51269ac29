# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The live node."""

from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.live_parameters import LiveParameters
from phase_traj_ros.ros.work import Work
from rclpy.node import Node


class PhaseTrajNode(Node):
    """Works from its start to its end."""

    def __init__(self) -> None:
        """
        Declare the parameters and start listening.

        Raises
        ------
        ParameterError
            A parameter given at the start is not allowed.
        OutputError
            Shifts are to be recorded and cannot be.
        MissingDependencyError
            What a parameter asks for is not installed.

        """
        super().__init__(NODE_NAME, enable_logger_service=True)
        self._live = LiveParameters(self, lambda values: self._work.change(values))
        self._work = Work(self, self._live.values)
        self._work.start()
        self._live.tell()

    def destroy_node(self) -> None:
        """Take the node down."""
        self._work.close()
        super().destroy_node()
