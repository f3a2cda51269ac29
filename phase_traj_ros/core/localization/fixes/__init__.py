# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Position fixes: their gate, their likelihood, and the track that they refer to."""
