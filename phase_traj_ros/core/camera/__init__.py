# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera: its lens, its tilt, and the projection of its frames onto a cylinder."""
