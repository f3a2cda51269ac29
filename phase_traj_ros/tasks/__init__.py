# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whole tasks: replays with their results, batches, evaluations, locations."""
