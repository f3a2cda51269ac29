# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of the camera, and the cylinder that its frames are projected onto."""
