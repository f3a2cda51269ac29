# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of surfaces, and the outlines that cut them."""
