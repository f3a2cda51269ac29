# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides when the leading place is claimed, and when the vehicle has left the roads."""

from collections import deque

from phase_traj_ros.core.localization.places import Place
from phase_traj_ros.core.localization.settings import LocatorSettings


class Claim:
    """Claims a place once it has been probable for some distance, until it is improbable."""

    def __init__(self, settings: LocatorSettings, *, on_map: bool = False) -> None:
        """
        Start without a claim.

        ``on_map`` says that the vehicle is known to be on the map: a claim needs no turns.
        """
        self._settings = settings
        self._on_map = on_map
        self.drop()

    def drop(self) -> None:
        """Drop the claim; no place leads."""
        self.leads = False
        """Whether a place has been probable for long enough."""
        self.held = False
        """Whether the leading place is claimed."""
        self._sure_m = 0.0
        self._last: complex | None = None

    def prove(self) -> None:
        """Claim the leading place, if any: an independent measurement has confirmed it."""
        if self.leads:
            self._on_map = self.held = True

    def follow(self, place: Place, metres: float, *, turned: float) -> None:
        """
        Update the claim by the most probable place after a stride of a length in metres.

        ``turned`` is the sum of the absolute angles turned since the start, in radians, beyond the
        noise of each stride. If the place has jumped, it is a different one.
        """
        settings = self._settings
        jumped = self._last is not None and (
            abs(place.position - self._last) > settings.mode_m + 2 * metres)
        if jumped or place.probability < settings.drop_below:
            self.drop()
        if self.leads or place.probability > settings.claim_above:
            self._sure_m += metres if self._last is not None else 0.0
            self._last = place.position
        else:
            self.drop()
        self.leads = self.leads or self._sure_m >= settings.claim_after_m
        self.held = self.leads and (self._on_map or turned >= settings.claim_turned)


class DepartureDetector:
    """
    Detects that the vehicle has left the roads of the map.

    While a place leads, its roads bend as the odometry does. If the evidence for them drops
    sharply within a short distance, the vehicle is no longer on them.
    """

    def __init__(self, settings: LocatorSettings) -> None:
        """Start without any evidence."""
        self._settings = settings
        self._past: deque[tuple[float, float]] = deque()

    def follow(self, travelled: float, evidence: float) -> bool:
        """
        Take the evidence for a leading place; return whether the vehicle has just left the roads.

        Parameters
        ----------
        travelled
            Metres travelled so far.
        evidence
            Log-likelihood of the drive so far on the roads of the map, minus that under the null
            hypothesis.

        """
        self._past.append((travelled, evidence))
        while travelled - self._past[0][0] > self._settings.lost_within_m:
            self._past.popleft()
        if max(before for _, before in self._past) - evidence < self._settings.lost_nats:
            return False
        self._past.clear()
        return True
