# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The live side: a thin rclpy node around the estimator, and a player of recorded frames."""
