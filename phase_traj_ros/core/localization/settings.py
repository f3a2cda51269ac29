# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the locator, in physical units."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class LocatorSettings:
    """Settings of the locator; nobody has to change them."""

    claim_above: float = 0.99
    """A place is claimed when its probability has been above this..."""
    claim_after_m: float = 20.0
    """...for this many metres..."""
    drop_below: float = 0.5
    """...and dropped when it falls below this."""
    most_candidates: int = 20
    """Candidates in an estimate."""
