# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""From frames to yaw, heading and turns, where the focal length is known."""
