# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Prepares the frames: checks, converts and weights them; finds repeated ones and jitter."""
