# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates an odometry on a road map."""

from collections import deque
from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization import fixes
from phase_traj_ros.core.localization.claim import Claim, DepartureDetector
from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.core.localization.filter.hypotheses import Hypotheses
from phase_traj_ros.core.localization.filter.likelihood import NullHypothesis, weigh
from phase_traj_ros.core.localization.filter.motion import MotionModel
from phase_traj_ros.core.localization.filter.resampling import merged, pruned, resampled, split
from phase_traj_ros.core.localization.filter.scales import ScaleCorrection
from phase_traj_ros.core.localization.filter.seeding import Seeding
from phase_traj_ros.core.localization.filter.strides import DeadReckoning, Stride
from phase_traj_ros.core.localization.given import OdometryStep, PositionFix, Prior, ScaleRange
from phase_traj_ros.core.localization.places import Place, Places
from phase_traj_ros.core.localization.roads import PIECE_M, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.path.odometry import covariance_rows


class MapLocator:
    """
    Locates a vehicle on a road map by map matching of its odometry.

    The hypotheses of a particle filter follow the odometry along the roads. Those whose roads
    bend differently lose weight. The random numbers have a fixed seed, so equal input gives equal
    output.
    """

    def __init__(
        self, roads: RoadMap, *, scale: ScaleRange | None = None, prior: Prior | None = None,
        settings: LocatorSettings | None = None, seed: int = 0,
    ) -> None:
        """
        Make a locator.

        Parameters
        ----------
        roads
            The map.
        scale
            Metres per unit of the odometry; None for ``ScaleRange()``, an odometry in metres.
        prior
            Where on the map the vehicle starts; None for anywhere on the map or off its roads.
            Without a prior, no place is claimed before some turns.
        settings
            The settings; None for the defaults.
        seed
            Seed of the random numbers.

        Raises
        ------
        ValueError
            No road is within the prior.

        """
        settings, scale = settings or LocatorSettings(), scale or ScaleRange()
        self._settings, self._scale, self._roads = settings, scale, roads
        self._rng = np.random.default_rng(seed)
        self._scale_correction = ScaleCorrection(scale, settings)
        self._motion = MotionModel(roads, scale, settings, self._rng)
        self._places = Places(roads, settings)
        self._reckoning = DeadReckoning(settings, scale.middle)
        self._seeding = Seeding(roads, scale, settings, self._rng, self._reckoning)
        self._claim = Claim(settings, on_map=prior is not None)
        self._departure = DepartureDetector(settings)
        self._gate = fixes.FixGate(settings)
        self._null = NullHypothesis(settings)
        log_mapped = math.log1p(-settings.null_share)
        self._per_piece = min(
            max(settings.most_at_start // len(roads), settings.per_piece), settings.most_per_piece)
        self._most = max(settings.most_hypotheses, (self._per_piece + 1) * len(roads))
        self._hypotheses = (
            self._seeding.anywhere(log_mapped, copies=self._per_piece)
            if prior is None else self._seeding.around(prior, log_mapped))
        self._track = fixes.Track()
        self._seeded_at = 0.0
        self._past: deque[_Moment] = deque(maxlen=settings.u_turn_strides)
        self._found = self._places.best(self._hypotheses, self._log_total())

    def update(self, step: OdometryStep) -> LocationEstimate:
        """
        Take the next step of the odometry; return the estimate after it.

        The filter is updated every 5 m, by parts of a longer step. The steps in between displace
        its last result. A step of more than a kilometre counts as an interruption.
        """
        if abs(step.distance) * self._scale.middle > self._settings.moved_m:
            # The turns on the way are unknown.
            self.interrupt(math.inf, turn=math.pi)
        else:
            self._follow_step(step)
        self._track.add(step.stamp_ns, *self._newest)
        return self._estimate(step.stamp_ns)

    def _follow_step(self, step: OdometryStep) -> None:
        """Update the filter by each stride of a step that is complete."""
        strides = math.ceil(abs(step.distance) / self._reckoning.stride)
        for part in step.parts(max(strides, 1)):
            stride = self._reckoning.add(part)
            if stride is None:
                continue
            if self._claim.leads and stride.in_reverse > stride.distance:
                self._follow_reversal(stride)
            else:
                self._follow(stride)

    @property
    def _newest(self) -> tuple[complex, float]:
        """Return the newest position, in the axes of the odometry, and the metres travelled."""
        return self._reckoning.position + self._reckoning.since, self._travelled

    @property
    def _travelled(self) -> float:
        """Return the metres travelled, forward and reverse."""
        return self._reckoning.way * self._scale.middle

    def _follow(self, stride: Stride) -> None:
        """Update the filter and the claim by a stride."""
        settings, metres = self._settings, stride.distance * self._scale.middle
        hypotheses = self._motion.advance(self._hypotheses, stride, self._most)
        before = hypotheses.log_total
        self._null.follow(stride, metres, weigh(hypotheses, stride, settings))
        self._hypotheses = self._with_u_turns(hypotheses, stride)
        if stride.repeated:
            # The probability of the map stays.
            self._null.log_weight += self._hypotheses.log_total - before
        self._reseed()
        hypotheses = merged(pruned(self._hypotheses, settings), settings, self._rng)
        hypotheses = resampled(hypotheses, self._most, self._rng)
        copies = self._scale_correction.follow(hypotheses, stride, metres)
        fewest = settings.fewest_hypotheses if self._claim.leads else min(
            settings.fewest_searching, self._per_piece * len(self._roads))
        self._hypotheses = split(hypotheses, min(copies * fewest, settings.most_hypotheses))
        if self._claim.leads:
            # The vehicle may leave the roads. While no place leads, most hypotheses are wrong, and
            # their gains on straight roads would pass to the null hypothesis.
            self._null.log_weight = float(np.logaddexp(
                self._null.log_weight,
                self._hypotheses.log_total + math.log(settings.null_hazard)))
        self._found = self._places.best(self._hypotheses, self._log_total())
        self._claim.follow(self._found[0], metres, turned=self._null.turned)
        if self._claim.leads and self._departure.follow(
                self._travelled, self._hypotheses.log_total - self._null.log_evidence):
            # The null hypothesis becomes at least as probable as all roads together.
            self._null.log_weight = max(self._null.log_weight, self._hypotheses.log_total)
            self._seeded_at = self._travelled
            self._claim.drop()

    def _follow_reversal(self, stride: Stride) -> None:
        """
        Update the filter by a stride with more reverse than forward motion.

        Its distance does not tell on which road it ends: the vehicle may have backed into another.
        """
        self._restart()
        self._replace(self._spread(self._settings.reversed_m, 0.0, stride.displacement))
        self._find(self._settings.drop_below)

    def _reseed(self) -> None:
        """Seed the whole map from time to time while the vehicle is probably off the roads."""
        settings, null = self._settings, self._null
        share = math.exp(null.log_weight - self._log_total())
        if (share > settings.away and self._travelled - self._seeded_at > settings.reseed_every_m):
            self._seeded_at = self._travelled
            returning = null.log_weight + math.log(settings.return_anywhere)
            self._hypotheses = self._hypotheses.joined(self._seeding.anywhere(returning))
            null.log_weight += math.log1p(-settings.return_anywhere)

    def _with_u_turns(self, hypotheses: Hypotheses, stride: Stride) -> Hypotheses:
        """Return the hypotheses; after a U-turn, also those that turned back on their road."""
        settings, reckoning = self._settings, self._reckoning
        before = self._past[0] if len(self._past) == self._past.maxlen else None
        self._past.append(_Moment(
            self._hypotheses if len(self._hypotheses) <= settings.most_hypotheses else None,
            reckoning.heading, reckoning.position, self._null.log_fit))
        if before is None or before.hypotheses is None:
            return hypotheses
        off = abs(abs(reckoning.heading - before.heading) - math.pi)
        if off > settings.u_turn or stride.bend > math.pi / 2:
            return hypotheses
        self._past.clear()
        back = self._motion.turned_back(
            before.hypotheses, reckoning.position - before.position, self._most)
        back.log_weight = back.log_weight + (
            math.log(settings.turn_back) + self._null.log_fit - before.log_fit)
        return hypotheses.joined(self._seeding.retraced(back))

    def _find(self, least: float) -> None:
        """Find the places; drop the claim unless the first one has at least this probability."""
        self._found = self._places.best(self._hypotheses, self._log_total())
        if self._found[0].probability < least:
            self._claim.drop()

    def _log_total(self) -> float:
        """Return the logarithm of the total weight, including the null hypothesis."""
        return float(np.logaddexp(self._hypotheses.log_total, self._null.log_weight))

    def _estimate(self, stamp_ns: int) -> LocationEstimate:
        place, candidates = self._found[0], tuple(map(self._candidate, self._found))
        best, scale = candidates[0], math.exp(place.log_scale)
        return LocationEstimate(
            stamp_ns=stamp_ns, claimed=self._claim.held, x=best.x, y=best.y, heading=best.heading,
            probability=best.probability, covariance=covariance_rows(place.covariance),
            scale=scale, scale_deviation=scale * place.scale_deviation, candidates=candidates)

    def _candidate(self, place: Place) -> Candidate:
        position = place.displaced(self._reckoning.since)
        return Candidate(
            position.real, position.imag,
            math.remainder(self._reckoning.heading + place.rotation, math.tau),
            min(place.probability, 1.0))

    def fix(self, fix: PositionFix) -> bool:
        """
        Take a position fix; return whether it was used.

        The fix applies to the pose at its stamp. It is not used if the stamp is more than 5 s
        older than the newest pose, more than 1 s ahead of it, or before the last interruption.

        A fix that contradicts the leading place is not used, unless several successive ones, each
        at least 5 m after the last, agree with each other. Nor is a fix less than 5 m after the
        last one: successive fixes share their errors. Nor is one at the very position of a fix
        more than 5 m before: the receiver repeats it. A fix that agrees with the leading place
        proves it, if its standard deviation is less than the radius of a place.
        """
        try:
            position, travelled = (
                self._newest if fix.stamp_ns is None else self._track.at(fix.stamp_ns))
        except ValueError:
            return False
        since, place = position - self._reckoning.position, self._found[0]
        decision = self._gate.judge(
            fix, travelled, place.displaced(since) if self._claim.leads else None,
            place.covariance[:2, :2])
        if decision is fixes.GateDecision.REJECT:
            return False
        if decision is fixes.GateDecision.RESTART:
            self._restart_at(fix, since)
        else:
            self._weigh(fix, since)
            if fixes.radius_of(fix) < self._settings.mode_m:
                self._claim.prove()
        self._found = self._places.best(self._hypotheses, self._log_total())
        return True

    def _weigh(self, fix: PositionFix, since: complex) -> None:
        """
        Weigh the hypotheses by a fix, tempered like a chord: successive fixes are correlated.

        ``since`` is the displacement of the odometry from the last stride to the fix.
        """
        settings, hypotheses, area = self._settings, self._hypotheses, self._roads.area
        fit = fixes.log_likelihood(fix, hypotheses.displaced(since), area, settings)
        hypotheses.log_weight = hypotheses.log_weight + settings.tempering * fit
        self._null.add_log_likelihood(
            settings.tempering * fixes.log_likelihood_off_road(fix, area, settings))

    def _restart_at(self, fix: PositionFix, since: complex) -> None:
        """
        Seed hypotheses around a fix, and reduce all others to the probability of an outlier.

        ``since`` is the displacement of the odometry from the last stride to the fix.
        """
        settings = self._settings
        total, outlier = self._log_total(), math.log(settings.fix_outliers)
        self._hypotheses.log_weight = self._hypotheses.log_weight + outlier
        self._null.log_weight = total + outlier
        # The direction of the motion since the fix is not known.
        moved = abs(self._reckoning.since - since) * self._scale.middle
        prior = Prior(
            fix.x, fix.y, 3.0 * math.hypot(fixes.radius_of(fix), settings.fix_road_m) + moved)
        if self._roads.distance_to(fix.x, fix.y) <= prior.radius:
            near = self._seeding.around(prior, total)
            near.log_weight = near.log_weight + fixes.log_likelihood(
                fix, near.displaced(since), self._roads.area, settings)
            near.log_weight += total - near.log_total
            self._hypotheses = self._hypotheses.joined(near)
        self._claim.drop()
        self._departure = DepartureDetector(self._settings)
        self._past.clear()

    def interrupt(self, distance: float, *, turn: float = 0.0) -> None:
        """
        Report a gap, a cut or a reset of the odometry: the vehicle may have moved unobserved.

        Parameters
        ----------
        distance
            Largest distance that the vehicle may have driven in the meantime, in metres;
            infinite if it is unknown, as after a reset.
        turn
            Standard deviation of the unobserved change of the heading in radians; pi or more if
            it is unknown.

        Raises
        ------
        ValueError
            An argument is negative or NaN.

        """
        if not (distance >= 0.0 and turn >= 0.0):
            raise ValueError(
                f'the interruption is of {distance} m and {turn} rad: give numbers of 0 or more')
        self._gate.reset(anywhere=distance > self._settings.moved_m, known=self._claim.leads)
        self._track = fixes.Track()
        if distance > self._settings.moved_m:
            self._replace(self._spread(self._settings.moved_m, turn, self._restart()))
            self._add_anywhere(self._settings.moved_anywhere)
        else:
            self._continue(distance, turn)
        self._scale_correction.interrupt(distance * distance / 3)
        self._find(self._settings.claim_above)

    def _continue(self, distance: float, turn: float) -> None:
        """Move each hypothesis along its road by up to ``distance``, see ``interrupt``."""
        settings, log_total = self._settings, self._hypotheses.log_total
        most = int(settings.most_passed / (1.0 + distance / PIECE_M))
        since = self._restart()
        spread = self._spread(distance, turn, since)
        moved = self._motion.unobserved(
            resampled(self._hypotheses, most, self._rng), since, distance, most)
        if turn < settings.unknown_heading:
            moved = self._seeding.aligned(moved, turn)
            self._null.variance += turn ** 2
        else:
            moved = self._seeding.facing(moved.joined(self._motion.facing_back(moved)))
            moved.log_weight = moved.log_weight - math.log(2.0)
            self._null.variance = settings.start_heading ** 2
        moved = self._seeding.retraced(moved)
        if len(spread):
            spread.log_weight += log_total + math.log(settings.gap_off_road) - spread.log_total
            moved = moved.joined(spread)
        self._hypotheses = resampled(merged(moved, settings, self._rng), self._most, self._rng)

    def _restart(self) -> complex:
        """Begin a new stride and trail; return the displacement since the last stride."""
        since = self._reckoning.since
        self._reckoning.restart()
        self._past.clear()
        self._departure = DepartureDetector(self._settings)
        return since

    def _spread(self, distance: float, turn: float, since: complex) -> Hypotheses:
        """
        Return a sample of the hypotheses, spread over the roads that each may have reached.

        The vehicle is up to ``distance`` metres from the end of the displacement ``since``, and
        its heading is off by ``turn`` radians, see ``interrupt``.
        """
        sample = resampled(self._hypotheses, self._settings.spread_from, self._rng)
        return self._seeding.spread(sample, distance + PIECE_M, turn, since)

    def _replace(self, hypotheses: Hypotheses) -> None:
        """Replace the hypotheses by others, unless there are none; any heading is possible."""
        settings = self._settings
        self._null.variance = settings.start_heading ** 2
        if len(hypotheses):
            self._hypotheses = resampled(
                merged(hypotheses, settings, self._rng), settings.most_hypotheses, self._rng)

    def _add_anywhere(self, share: float) -> None:
        """Give a share of the total weight to hypotheses on the whole map, as at the start."""
        total, null_share = self._log_total(), self._settings.null_share
        anywhere = total + math.log(share)
        hypotheses = self._hypotheses
        hypotheses.log_weight = hypotheses.log_weight + math.log1p(-share)
        self._hypotheses = hypotheses.joined(
            self._seeding.anywhere(anywhere + math.log1p(-null_share)))
        self._null.log_weight = float(np.logaddexp(
            self._null.log_weight + math.log1p(-share), anywhere + math.log(null_share)))


@dataclass(frozen=True, slots=True)
class _Moment:
    """The state at a stride, for U-turns; without the hypotheses if there are too many."""

    hypotheses: Hypotheses | None
    heading: float
    position: complex
    log_fit: float
