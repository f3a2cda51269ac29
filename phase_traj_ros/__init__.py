# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Chain codes of a vehicle's trajectory from one forward-facing camera."""

__version__ = '0.1.0'
