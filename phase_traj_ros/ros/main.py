# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of the executable ``phase_traj_node``."""

import sys

from phase_traj_ros.errors import PhaseTrajError
from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.node import PhaseTrajNode
from phase_traj_ros.ros.spin import ros_context, spin
from rclpy.logging import get_logger

EXIT_BAD_INPUT = 2


def main(arguments: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit status."""
    try:
        with ros_context(arguments) as stop:
            spin(PhaseTrajNode, stop)
    except PhaseTrajError as error:
        get_logger(NODE_NAME).fatal(str(error))
        return EXIT_BAD_INPUT
    return 0


if __name__ == '__main__':
    sys.exit(main())
