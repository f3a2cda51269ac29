# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One source replayed with all its results, and many of them in parallel."""
