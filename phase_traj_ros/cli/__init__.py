# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: parses arguments and prints results; the other packages do the work."""
