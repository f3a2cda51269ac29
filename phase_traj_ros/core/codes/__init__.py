# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The codes: movement and direction, and the state machines that make them."""
