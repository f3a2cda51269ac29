# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera learned from the drive itself: points followed through turns, and what they tell."""
