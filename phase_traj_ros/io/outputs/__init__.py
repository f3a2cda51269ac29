# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The outputs of a run: staged, written as a set, and listed in a manifest."""
