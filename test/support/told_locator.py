# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A locator that is told the truth, and claims it after some metres."""

import math

from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate

AFTER = 300.0


class ToldLocator:
    """Follows a drive from its true start; the interface is that of MapLocator."""

    def __init__(self, start, *, after=AFTER):
        self.interruptions = []
        self.fixes = []
        self._x, self._y, self._yaw = start
        self._after = after
        self._driven = 0.0

    def update(self, step):
        middle = self._yaw + step.yaw / 2
        self._x += step.distance * math.cos(middle)
        self._y += step.distance * math.sin(middle)
        self._yaw += step.yaw
        self._driven += abs(step.distance)
        claimed = self._driven >= self._after
        probability = 0.995 if claimed else 0.3
        return LocationEstimate(
            step.stamp_ns, claimed, self._x, self._y, math.remainder(self._yaw, math.tau),
            probability, ((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 1e-3)), 1.0, 0.01,
            candidates=(
                Candidate(self._x, self._y, self._yaw, probability),
                Candidate(-self._x, -self._y, 0.0, 1.0 - probability)))

    def fix(self, fix):
        self.fixes.append(fix)
        return True

    def interrupt(self, distance, *, turn=0.0):
        self.interruptions.append((distance, turn))
        self._driven = 0.0
