# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the shift between two frames, and tests whether it is a valid measurement."""
