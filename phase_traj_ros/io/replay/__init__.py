# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A source of frames driven through the estimator, and what is gathered from it."""
