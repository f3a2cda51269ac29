# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Clips and their degradations, the peers, timing side by side, tables."""
