# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of the executable ``phase_traj_node``."""

from collections.abc import Sequence
import sys

from phase_traj_ros.ros.startup.signals import stop_on_signals


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT, SIGTERM or SIGHUP; return the exit status."""
    with stop_on_signals() as stop:
        # Imported here: the imports take a second, and a signal may arrive meanwhile.
        from phase_traj_ros.ros.nodes.run import run
        return run(stop, arguments)


if __name__ == '__main__':
    sys.exit(main())
