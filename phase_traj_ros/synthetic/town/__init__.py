# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Streets, buildings and paving: complete scenes to drive through."""
