# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Time and memory: a step, its options, a replay, the node."""
