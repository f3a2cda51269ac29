# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How the node is doing: counters, rates and /diagnostics."""
