# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The programs that write docs/measurements: rooms by what they measure."""
