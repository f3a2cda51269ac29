# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Replays one source with all its results, or many sources in parallel."""
