# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides whether the result of a drive is reliable, and if not, when and why."""
