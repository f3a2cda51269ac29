# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Learns the camera from the drive, by points that are tracked through turns."""
