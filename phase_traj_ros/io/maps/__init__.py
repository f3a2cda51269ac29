# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads and writes road maps of OpenStreetMap, projected to metres."""
