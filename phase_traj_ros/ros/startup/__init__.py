# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Start and stop of the node: launch arguments, overrides, parameter files and signals."""
