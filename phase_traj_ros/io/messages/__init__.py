# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Between ROS messages and values, whichever library made the messages."""
