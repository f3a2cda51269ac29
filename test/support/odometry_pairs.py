# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of frames, as the odometry takes them."""

from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.road.travel import Travel, TravelState

TENTH = 100_000_000


def step(yaw, heading, *, deviation=0.001):
    return HeadingStep(yaw, yaw / 0.1, heading, False, deviation ** 2)


def gone(distance, *, share=0.05, **alike):
    return Travel(distance, (share * distance) ** 2, TravelState.MEASURED, **alike)
