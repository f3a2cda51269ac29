# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The movement and direction codes, and the state machines that generate them."""
