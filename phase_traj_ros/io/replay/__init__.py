# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs a source of frames through the estimator, and collects the results."""
