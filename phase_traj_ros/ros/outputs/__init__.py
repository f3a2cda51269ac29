# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishers: codes, shift, path, pose, transform, debug image."""
