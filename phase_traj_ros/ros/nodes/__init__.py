# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The plain and the managed node, their parameters, and their common work."""
