# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the vehicle has gone, from how the road passes below it."""
