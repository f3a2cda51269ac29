# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The particle filter: weighted hypotheses that follow the odometry along the roads."""
