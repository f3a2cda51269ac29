# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings played to a node, and what it publishes gathered."""
