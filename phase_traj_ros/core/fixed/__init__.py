# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds the parts of the image that are fixed to the camera."""
