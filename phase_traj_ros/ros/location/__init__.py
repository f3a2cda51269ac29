# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates the vehicle on a road map while it drives."""
