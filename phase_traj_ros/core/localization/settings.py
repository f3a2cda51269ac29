# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the locator, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class LocatorSettings:
    """
    Settings of the locator; users need not change them.

    The values were chosen on the drives of docs/measurements/locate.md. Lengths are in metres,
    angles in radians; deviations are standard deviations.
    """

    stride_m: float = 5.0
    """Distance between two updates of the filter."""
    chord_strides: int = 4
    """Strides per chord: chords of 20 m absorb lanes and cut corners."""

    position_noise_m: float = 2.0
    """Deviation of the distance per root of 100 m, in addition to that of the odometry."""
    turn_m: float = 4.0
    """Deviation of the position of a turn along the road; the scale is estimated from turns."""
    least_turn: float = math.radians(40.0)
    """Least angle of such a turn."""
    turn_over: float = math.radians(12.0)
    """A turn ends when the chord bends by less than this."""
    scale_noise: float = 0.01
    """Relative drift of the scale per root of 100 m, bounded by the prior."""
    heading_noise: float = math.radians(1.0)
    """Drift of the heading per root of 100 m, in addition to that of the odometry."""
    start_heading: float = math.radians(10.0)
    """Deviation of the heading of the vehicle from the direction of its road at the start."""
    unknown_heading: float = math.radians(60.0)
    """A heading with a larger deviation counts as unknown."""

    corner_m: float = 5.5
    """Radius with which a vehicle cuts the corners of the map."""
    chord_error: float = math.radians(1.5)
    """Deviation between the chords of the map and of the vehicle on a straight road."""
    bend_error: float = 0.15
    """Additional deviation, as a share of the bends of both chords."""
    dead_band: float = math.radians(1.0)
    """Smaller differences between the chords count as none."""
    outlier_share: float = 0.03
    """Share of chords with a random direction."""
    tempering: float = 0.5
    """Exponent of the likelihood of a chord: successive chords overlap and share their errors."""

    straight_on: float = 3.0
    """Weight of going straight on at a junction; that of a turn is 1."""
    straight: float = math.radians(30.0)
    """Going straight on is a turn by less than this."""
    sharp_turn: float = 0.3
    """Weight of a sharp turn, which does not cut the corner."""
    sharp: float = math.radians(120.0)
    """A sharp turn is one by more than this."""
    wrong_way: float = 0.1
    """Factor of the weight of driving against a one-way street."""
    turn_back: float = 0.02
    """Probability that a U-turn is made on the road."""
    u_turn_strides: int = 7
    """Number of strides over which a U-turn is detected."""
    u_turn: float = math.radians(30.0)
    """Largest deviation of a U-turn from half a circle."""
    road_ends: float = 0.3
    """Probability of turning back at the end of a road."""

    null_share: float = 5e-3
    """Prior probability of the null hypothesis: the vehicle is on no road of the map."""
    null_fit_m: float = 250.0
    """The fit of the null hypothesis is the mean fit of the map over this distance..."""
    null_fit: float = 0.5
    """...but at least this, relative to the peak of the likelihood."""
    null_turn: float = 1.5
    """Penalty of the null hypothesis in nats per radian of turns. The true place loses less at its
    turns, the best place of a map without the vehicle loses more."""
    null_straight: float = math.radians(0.5)
    """Turns per stride up to this angle have no penalty."""
    lap_apart_m: float = 40.0
    """A vehicle drives another lap if its odometry comes within this distance of an earlier
    pose..."""
    lap_heading: float = math.radians(45.0)
    """...with a heading that differs by less than this..."""
    shortest_lap_m: float = 60.0
    """...after at least this way..."""
    longest_lap_m: float = 5000.0
    """...and about this way at most."""
    null_hazard: float = 3e-5
    """Probability per stride of leaving the roads of the map, while a place leads."""

    least_weight: float = 14.0
    """Hypotheses this many nats below the best one are dropped."""
    most_hypotheses: int = 120_000
    """Largest number of hypotheses."""
    most_at_start: int = 500_000
    """Largest number at the start without a prior; bounds memory and time."""
    most_per_piece: int = 4
    """Most hypotheses per piece of road at the start: on a small map, several reach the first bend
    at the true place."""
    per_piece: int = 2
    """Fewest hypotheses per piece of road at the start."""
    fewest_around: int = 4_000
    """Fewest hypotheses around a point: several per piece of road."""
    fewest_hypotheses: int = 1_500
    """Hypotheses are split below this number while a place leads."""
    fewest_searching: int = 30_000
    """While no place leads, they are split below this number, or that of the start if less."""
    merge_m: float = 1.5
    """Hypotheses on one piece are merged if they are in one bin of this length..."""
    merge_scale: float = 0.01
    """...of this width in the logarithm of the scale..."""
    merge_heading: float = math.radians(11.0)
    """...and of this width in the rotation."""
    mode_m: float = 35.0
    """Radius of a place, and size of the cells in which places are looked for."""
    mode_heading: float = math.radians(25.0)
    """Largest deviation of the heading within a place."""
    most_cells: int = 64
    """Most cells in which places are looked for."""
    sectors: int = 8
    """Sectors of headings per cell."""
    most_candidates: int = 20
    """Most candidates of an estimate."""
    least_candidate: float = 1e-3
    """Least probability of a candidate other than the first one."""
    claim_above: float = 0.99
    """A place is claimed when its probability has been above this..."""
    claim_after_m: float = 20.0
    """...for this many metres..."""
    drop_below: float = 0.5
    """...until it falls below this."""
    claim_turned: float = 2 * math.pi
    """Without a prior, a claim needs turns by this angle in total: straight roads look alike."""

    lost_nats: float = 6.0
    """The vehicle has left the roads of the map when the evidence falls by this..."""
    lost_within_m: float = 60.0
    """...within this distance."""
    moved_m: float = 1000.0
    """An unobserved motion of unknown length ends within this distance..."""
    moved_anywhere: float = 0.5
    """...or, with this probability, on any road of the map."""
    reversed_m: float = 20.0
    """After more reverse than forward motion, the vehicle is within this distance of where the
    odometry says."""
    return_anywhere: float = 0.1
    """Probability that a vehicle off the roads has returned to any road of the map..."""
    reseed_every_m: float = 100.0
    """...after this distance..."""
    away: float = 0.5
    """...if the probability of the null hypothesis is above this."""
    gap_off_road: float = 0.02
    """Probability that the way in a shorter gap is not on the map, or is not one along roads."""
    most_passed: int = 2_000_000
    """Most pieces of road that all hypotheses together pass in an unobserved motion."""
    spread_from: int = 100
    """Number of hypotheses from which new ones are spread after a gap, a reset, or in reverse."""

    fix_road_m: float = 4.0
    """Deviation of a vehicle from the centre line of its road, for position fixes."""
    fix_gate: float = 4.0
    """A fix is doubted if it is off by more than this many standard deviations..."""
    fixes_to_convince: int = 5
    """...until this many successive ones agree with each other."""
    fix_outliers: float = 0.02
    """Share of fixes with a random position."""
    fix_spacing_m: float = 5.0
    """Of fixes that are closer together, only the first is used: they share their errors."""

    @classmethod
    def of_links(cls, metres: float) -> 'LocatorSettings':
        """
        Return the settings for a bare code of equal links, with the length of a link in metres.

        A stride is two links, since each direction is off by up to half a sector. The vehicle is
        assumed to be on the map: so coarse a drive cannot prove it.
        """
        return cls(
            stride_m=1.99 * metres, mode_m=50.0, chord_error=math.radians(9.0),
            dead_band=math.radians(6.0), bend_error=0.35, position_noise_m=3.0,
            start_heading=math.radians(15.0), turn_m=metres, tempering=1.0, null_share=1e-100,
            null_hazard=1e-100)
