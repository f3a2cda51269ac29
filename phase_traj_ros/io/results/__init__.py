# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a replay leaves behind: files, figures, bags, reports."""
