# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts ROS messages to values and back, for messages of any library."""
