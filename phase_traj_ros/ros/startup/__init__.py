# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What an executable was started with, and whether that makes sense; how it is told to stop."""
