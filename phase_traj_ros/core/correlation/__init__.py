# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""From two frames to the shift between them, and what that shift is worth."""
