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
    turn_m: float = 4.0
    """Error of the place of a turn along the road, from which the scale follows."""
    least_turn: float = math.radians(40.0)
    """Angle from which on a turn is one, ..."""
    turn_over: float = math.radians(12.0)
    """...which is over when the chord bends less than this."""
    scale_noise: float = 0.01
    """Drift of the scale, per root of 100 m; its prior bounds it."""
    heading_noise: float = math.radians(1.0)
    """Drift of the heading per root of 100 m; the odometry's is added."""
    start_heading: float = math.radians(10.0)
    """Deviation of the direction of the vehicle from that of its road, at the start."""
    unknown_heading: float = math.radians(60.0)
    """Deviation from which on an expected heading counts as unknown."""

    corner_m: float = 5.5
    """Radius with which a vehicle cuts the corners of the map."""
    chord_error: float = math.radians(1.5)
    """Deviation of a chord of the map from that of the vehicle on a straight road."""
    bend_error: float = 0.15
    """What the bends of both chords add to it, as a share of their angle."""
    dead_band: float = math.radians(1.0)
    """Difference of the chords that costs nothing."""
    outlier_share: float = 0.03
    """Share of chords that have any direction."""
    tempering: float = 0.5
    """Weight of a chord: successive chords overlap, and so do their errors."""

    straight_on: float = 3.0
    """Chance to go straight on at a junction, ..."""
    straight: float = math.radians(30.0)
    """...which is to turn by less than this, against 1 for a turn..."""
    sharp_turn: float = 0.3
    """...and this for a sharp one, which does not cut the corner, ..."""
    sharp: float = math.radians(120.0)
    """...above this angle."""
    wrong_way: float = 0.1
    """Factor of the chance to drive against a one-way street."""
    turn_back: float = 0.02
    """Chance that a U-turn is one on the road..."""
    u_turn_strides: int = 7
    """...if it takes at most so many strides..."""
    u_turn: float = math.radians(30.0)
    """...and differs by at most this from half a circle."""
    road_ends: float = 0.3
    """Chance to turn back where the road ends."""

    null_share: float = 5e-3
    """Probability at the start that the vehicle is on no road of the map: such a road bends..."""
    null_fit_m: float = 250.0
    """...as the odometry does: it fits as those of the map do on average over this way, but..."""
    null_fit: float = 0.5
    """...its chords have at least this mean likelihood, relative to its peak..."""
    null_turn: float = 1.5
    """...and it loses these nats per radian of its turns. The right road of a map loses fewer, and
    the best place of a map where the vehicle is not loses more..."""
    null_straight: float = math.radians(0.5)
    """...beyond this angle per stride."""
    null_hazard: float = 3e-5
    """Probability per stride to leave the roads of the map, while a place leads."""

    least_weight: float = 14.0
    """Hypotheses this many nats below the best are dropped."""
    most_hypotheses: int = 120_000
    """Most hypotheses."""
    most_at_start: int = 500_000
    """Most of them at the start without a prior, as they need memory and time, with..."""
    most_per_piece: int = 4
    """...at most so many on each piece of road, so that on a small map the right place has some at
    its first bend, ..."""
    per_piece: int = 2
    """...and at least so many."""
    fewest_around: int = 4_000
    """Fewest hypotheses around a point: several on each piece of road."""
    fewest_hypotheses: int = 1_500
    """Below this number, hypotheses are split, ..."""
    fewest_searching: int = 30_000
    """...and below this one, or as many per piece of road as at the start, while no place
    leads."""
    merge_m: float = 1.5
    """Hypotheses on one piece this close, ..."""
    merge_scale: float = 0.01
    """...this close in scale, ..."""
    merge_heading: float = math.radians(11.0)
    """...and in heading become one."""
    mode_m: float = 35.0
    """Radius of a place, ..."""
    mode_heading: float = math.radians(25.0)
    """...and its range of headings. It is looked for in..."""
    most_cells: int = 64
    """...so many cells of the map at most, squares of ``mode_m`` with..."""
    sectors: int = 8
    """...so many sectors of headings."""
    most_candidates: int = 20
    """Candidates in an estimate..."""
    least_candidate: float = 1e-3
    """...and the least probability of one besides the first."""
    claim_above: float = 0.99
    """A place is claimed when its probability has been above this..."""
    claim_after_m: float = 20.0
    """...for this many metres, until it falls below..."""
    drop_below: float = 0.5
    """...this. Without a prior..."""
    claim_turned: float = 2 * math.pi
    """...nothing is claimed before turns of this angle in all: any road may be straight."""

    lost_nats: float = 6.0
    """Fall of the evidence after which the vehicle counts as off the roads of the map..."""
    lost_within_m: float = 60.0
    """...within this distance."""
    return_anywhere: float = 0.1
    """Probability that a vehicle on no road is back on any road of the map..."""
    reseed_every_m: float = 100.0
    """...after this way, ..."""
    away: float = 0.5
    """...if it is on no road with a probability above this."""
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

    @classmethod
    def of_links(cls, metres: float) -> 'LocatorSettings':
        """
        Return the settings for a code of equal links of so many metres, and nothing else.

        A stride is two links, as each direction errs by up to half a sector. That the vehicle is
        on the map is assumed: so coarse a drive could not prove it.
        """
        return cls(
            stride_m=1.99 * metres, mode_m=50.0, chord_error=math.radians(9.0),
            dead_band=math.radians(6.0), bend_error=0.35, position_noise_m=3.0,
            start_heading=math.radians(15.0), turn_m=metres, tempering=1.0, null_share=1e-100,
            null_hazard=1e-100)
