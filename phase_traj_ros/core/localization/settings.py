# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the locator, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class LocatorSettings:
    """
    Settings of the locator; nobody has to change them.

    Where no source is given, the value was chosen on the drives of docs/measurements/locate.md.
    """

    stride_m: float = 5.0
    """Distance between two steps of the filter."""
    chord_strides: int = 4
    """Strides of a chord; chords of 20 m absorb lanes and cut corners."""

    position_noise_m: float = 2.0
    """Noise of the distance along the road, per root of 100 m; the odometry's is added."""
    scale_noise: float = 0.01
    """Drift of the scale, per root of 100 m; its prior bounds it."""
    heading_noise: float = math.radians(1.0)
    """Drift of the heading per root of 100 m; the odometry's is added."""
    start_heading: float = math.radians(10.0)
    """Deviation of the direction of the vehicle from that of its road, at the start."""

    corner_m: float = 5.5
    """Radius with which a vehicle cuts the corners of the map."""
    chord_error: float = math.radians(1.5)
    """Deviation of a chord of the map from that of the vehicle on a straight road."""
    bend_error: float = 0.25
    """What the bends of both chords add to it, as a share of their angle..."""
    bend_error_claimed: float = 0.15
    """...and once a place is claimed, when hypotheses are dense enough to be judged by more."""
    dead_band: float = math.radians(1.0)
    """Difference of the chords that costs nothing."""
    outlier_share: float = 0.03
    """Share of chords that have any direction."""
    tempering: float = 0.3
    """Weight of a chord: successive chords overlap, and so do their errors."""

    straight_on: float = 3.0
    """Chance to go straight on at a junction (below 30 degrees), against 1 for a turn..."""
    sharp_turn: float = 0.3
    """...and this for one above 120 degrees."""
    wrong_way: float = 0.1
    """Factor of the chance to drive against a one-way street."""
    turn_back: float = 0.02
    """Chance that a U-turn is one on the road."""
    road_ends: float = 0.3
    """Chance to turn back where the road ends."""

    evidence_at_start: float = -3.5
    """Log odds at the start that a road is the true one: the best of many fits by chance."""
    turn_price: float = 1.25
    """Nats that a road of no map pays for its turns, per radian..."""
    straight_turn: float = math.radians(0.5)
    """...beyond this angle per stride."""
    most_evidence: float = 10.0
    """Largest log odds: the vehicle may leave the roads of the map at any time."""

    least_weight: float = 14.0
    """Hypotheses this many nats below the best are dropped."""
    most_hypotheses: int = 60_000
    """Most hypotheses..."""
    most_at_start: int = 240_000
    """...and in the first strides..."""
    start_strides: int = 60
    """...of which there are this many."""
    fewest_hypotheses: int = 1_500
    """Below this number, hypotheses are split, ..."""
    fewest_searching: int = 60_000
    """...and below this one, or two per piece of road, while no place is claimed."""
    merge_m: float = 1.5
    """Hypotheses on one piece this close, ..."""
    merge_scale: float = 0.01
    """...this close in scale, ..."""
    merge_heading: float = math.radians(11.0)
    """...and in heading become one."""
    scales_after_turn: int = 12
    """Most scales that are tried for each hypothesis after the first turn."""

    mode_m: float = 35.0
    """Radius of a place, ..."""
    mode_heading: float = math.radians(25.0)
    """...and its range of headings."""
    most_candidates: int = 20
    """Candidates in an estimate."""
    claim_above: float = 0.99
    """A place is claimed when its probability is above this, ..."""
    claim_near: float = 0.9
    """...after it has been above this..."""
    claim_after_m: float = 100.0
    """...for this many metres: places that lead by chance do so for a short way..."""
    drop_below: float = 0.5
    """...until it falls below this."""

    lost_nats: float = 4.0
    """Fall of the evidence after which the vehicle counts as off the roads of the map..."""
    lost_within_m: float = 60.0
    """...within this distance."""
    reseed_near: float = 0.8
    """Share of the new hypotheses that are near the pose expected from the odometry..."""
    reseed_m: float = 25.0
    """...within this distance..."""
    reseed_growth: float = 0.1
    """...plus this share of the way since; the others are anywhere."""
    return_hazard: float = 0.05
    """Probability per stride that a lost vehicle is back on a road near the expected pose."""
    return_evidence: float = 2.0
    """Log odds that it is on these roads then, and not beside them."""
    return_anywhere: float = 0.02
    """Probability that a vehicle whose place is not known has come back to any road..."""
    reseed_every_m: float = 200.0
    """...within this way."""
    spread_from: int = 100
    """Hypotheses that stand for all when the odometry is interrupted."""

    fix_road_m: float = 4.0
    """Deviation of a vehicle from the line of its road, for position fixes."""
    fix_gate: float = 4.0
    """A fix this many standard deviations off is doubted..."""
    fixes_to_convince: int = 5
    """...until this many successive ones agree with each other."""
    fix_outliers: float = 0.02
    """Share of fixes that are anywhere."""
    fix_spacing_m: float = 5.0
    """Fixes closer together share their errors: only the first is used."""
