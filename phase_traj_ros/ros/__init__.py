# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ROS interface: a thin rclpy node around the estimator, and a player of recordings."""
