# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates an odometry on a road map."""

from collections import deque
from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.core.localization.fixes import (
    FixGate,
    log_likelihood,
    log_likelihood_off_road,
    radius_of,
    Verdict,
)
from phase_traj_ros.core.localization.given import OdometryStep, PositionFix, Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import (
    Hypotheses,
    merged,
    pruned,
    resampled,
    split,
)
from phase_traj_ros.core.localization.likelihood import judge, NullRoad
from phase_traj_ros.core.localization.motion import Motion
from phase_traj_ros.core.localization.places import Astray, Claim, Place, Places
from phase_traj_ros.core.localization.roads import PIECE_M, RoadMap
from phase_traj_ros.core.localization.seeding import Scales, Seeding
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer, Stride, Track


class MapLocator:
    """
    Finds where on a road map a vehicle is, from its odometry alone.

    Hypotheses about the place follow the odometry along the roads. Those whose roads bend
    otherwise than the odometry lose weight. The random numbers have a fixed seed, so equal input
    gives equal output.
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
            Metres per unit of the odometry; None for an odometry in metres within 5 %.
        prior
            Where on the map the vehicle starts; None for anywhere, if it is on it at all: then no
            place is claimed before some turns.
        settings
            The tuning; None for the defaults.
        seed
            Seed of the random numbers.

        Raises
        ------
        ValueError
            No road is within the prior.

        """
        self._settings = settings or LocatorSettings()
        self._scale = scale or ScaleRange()
        self._roads = roads
        self._rng = np.random.default_rng(seed)
        self._scales = Scales(self._scale, self._settings)
        self._seeding = Seeding(roads, self._scales, self._settings, self._rng)
        self._motion = Motion(roads, self._scale, self._settings)
        self._places = Places(roads, self._settings)
        self._odometer = Odometer(
            self._settings.stride_m / self._scale.middle, self._settings.chord_strides)
        self._claim = Claim(self._settings, on_map=prior is not None)
        self._astray = Astray(self._settings)
        self._gate = FixGate(self._settings)
        self._null = NullRoad(self._settings)
        mapped = math.log1p(-self._settings.null_share)
        self._per_piece = min(
            max(self._settings.most_at_start // len(roads), self._settings.per_piece),
            self._settings.most_per_piece)
        self._them = (
            self._seeding.anywhere(self._odometer, mapped, copies=self._per_piece) if prior is None
            else self._seeding.around(prior, self._odometer, mapped))
        self._track = Track()
        self._way = self._seeded = 0.0
        self._past: deque[_Moment] = deque(maxlen=self._settings.u_turn_strides)
        self._found = self._places.best(self._them, self._log_total())

    def update(self, step: OdometryStep) -> LocationEstimate:
        """
        Take the next step of the odometry; return the place after it.

        The hypotheses are judged every 5 m. Steps between only move the last estimate.
        """
        stride = self._odometer.add(step)
        if stride is not None:
            self._follow(stride)
        self._track.add(step.stamp_ns, *self._newest)
        return self._estimate(step.stamp_ns)

    @property
    def _newest(self) -> tuple[complex, float]:
        """Return the newest place of the odometry, in its axes and unit, and the metres driven."""
        since = self._odometer.since
        return self._odometer.place + since, self._way + abs(since) * self._scale.middle

    def _follow(self, stride: Stride) -> None:
        """Move and judge the hypotheses by a stride."""
        settings, metres = self._settings, stride.distance * self._scale.middle
        most = max(settings.most_hypotheses, (self._per_piece + 1) * len(self._roads))
        self._way += metres
        them = self._motion.advance(self._them, stride, most, self._rng)
        self._null.follow(stride, metres, judge(them, stride, settings))
        self._them = self._turned_back(them, stride, most)
        self._seed_sometimes()
        them = merged(pruned(self._them, settings), settings, self._rng)
        them = resampled(them, most, self._rng)
        copies = self._scales.after(them, stride, metres)
        self._them = split(them, min(copies * self._fewest(), settings.most_hypotheses))
        if self._claim.leads:
            # Some vehicles leave the roads of the map. While no place leads, most hypotheses are
            # wrong, and the null hypothesis would inherit what all of them gain on straights.
            self._null.log_weight = float(np.logaddexp(
                self._null.log_weight, self._them.log_total + math.log(settings.null_hazard)))
        self._found = self._places.best(self._them, self._log_total())
        self._claim.follow(self._found[0], metres, turned=self._null.turned)
        if self._claim.leads and self._astray.follow(
                self._way, self._them.log_total - self._null.log_alone):
            # The vehicle may be on no road as well as on these.
            self._null.log_weight = max(self._null.log_weight, self._them.log_total)
            self._seeded = self._way
            self._claim.drop()

    def _seed_sometimes(self) -> None:
        """Let vehicles on no road of the map come back to one."""
        settings, null = self._settings, self._null
        share = math.exp(null.log_weight - self._log_total())
        if share > settings.away and self._way - self._seeded > settings.reseed_every_m:
            self._seeded = self._way
            returning = null.log_weight + math.log(settings.return_anywhere)
            self._them = self._them.joined(self._seeding.anywhere(self._odometer, returning))
            null.log_weight += math.log1p(-settings.return_anywhere)

    def _turned_back(self, them: Hypotheses, stride: Stride, most: int) -> Hypotheses:
        """Return the hypotheses and, after a U-turn, also those that turned back on their road."""
        settings, odometer = self._settings, self._odometer
        before = self._past[0] if len(self._past) == self._past.maxlen else None
        self._past.append(_Moment(
            self._them if len(self._them) <= settings.most_hypotheses else None,
            stride.heading, odometer.place, self._null.log_fit))
        if before is None or before.them is None or not len(before.them):
            return them
        turned = abs(abs(stride.heading - before.heading) - math.pi)
        if turned > settings.u_turn or stride.bend > math.pi / 2:
            return them
        self._past.clear()
        back = self._motion.turned_back(before.them, odometer.place - before.place, most)
        back.log_weight = back.log_weight + (
            math.log(settings.turn_back) + self._null.log_fit - before.log_fit)
        return them.joined(self._seeding.retraced(back, odometer))

    def _log_total(self) -> float:
        return float(np.logaddexp(self._them.log_total, self._null.log_weight))

    def _fewest(self) -> int:
        settings = self._settings
        return settings.fewest_hypotheses if self._claim.leads else min(
            settings.fewest_searching, self._per_piece * len(self._roads))

    def _estimate(self, stamp_ns: int) -> LocationEstimate:
        place, candidates = self._found[0], tuple(map(self._candidate, self._found))
        best, scale = candidates[0], math.exp(place.log_scale)
        one, two, three = place.covariance.tolist()
        return LocationEstimate(
            stamp_ns=stamp_ns, claimed=self._claim.held, x=best.x, y=best.y, heading=best.heading,
            probability=best.probability, covariance=(tuple(one), tuple(two), tuple(three)),
            scale=scale, scale_deviation=scale * place.scale_deviation, candidates=candidates,
            off_road=math.exp(self._null.log_weight - self._log_total()))

    def _candidate(self, place: Place) -> Candidate:
        middle = place.carried(self._odometer.since)
        return Candidate(
            middle.real, middle.imag,
            math.remainder(self._odometer.heading + place.turned, math.tau),
            min(place.probability, 1.0))

    def fix(self, fix: PositionFix) -> bool:
        """
        Take a position; return whether it was used.

        It is compared with the place at its stamp. A stamp that is more than 5 s older than the
        newest pose, before the last interruption, or more than 1 s ahead, is not used.

        A fix that contradicts the place that leads, its own covariance and the odometry since is
        not used, unless the next ones agree with it. A fix that comes less than 5 m after the last
        one is not used either: successive fixes share their errors. One that agrees proves the
        place, if it is exact enough to tell it from others.
        """
        try:
            then, way = self._newest if fix.stamp_ns is None else self._track.at(fix.stamp_ns)
        except ValueError:
            return False
        since, place = then - self._odometer.place, self._found[0]
        verdict = self._gate.judge(
            fix, way, place.carried(since) if self._claim.leads else None,
            place.covariance[:2, :2])
        if verdict is Verdict.IGNORED:
            return False
        if verdict is Verdict.TRUSTED:
            self._start_again_at(fix, since)
        else:
            self._weigh(fix, since)
            if radius_of(fix) < self._settings.mode_m:
                self._claim.prove()
        self._found = self._places.best(self._them, self._log_total())
        return True

    def _weigh(self, fix: PositionFix, since: complex) -> None:
        """Weigh the hypotheses by a fix; its errors are as correlated as those of chords."""
        settings, them, area = self._settings, self._them, self._roads.area
        fit = log_likelihood(fix, them.carried(since), area, settings)
        them.log_weight = them.log_weight + settings.tempering * fit
        self._null.take(settings.tempering * log_likelihood_off_road(fix, area, settings))

    def _start_again_at(self, fix: PositionFix, since: complex) -> None:
        """
        Believe that the vehicle was where a fix is, but for a doubt.

        ``since`` is the displacement of the odometry from the last stride to the fix.
        """
        settings = self._settings
        total, doubt = self._log_total(), math.log(settings.fix_outliers)
        self._them.log_weight = self._them.log_weight + doubt
        self._null.log_weight = total + doubt
        # Nothing tells in which direction it has moved since.
        moved = abs(self._odometer.since - since) * self._scale.middle
        prior = Prior(
            fix.x, fix.y, 3.0 * math.hypot(radius_of(fix), settings.fix_road_m) + moved)
        if self._roads.distance_to(fix.x, fix.y) <= prior.radius:
            near = self._seeding.around(prior, self._odometer, total)
            near.log_weight = near.log_weight + log_likelihood(
                fix, near.carried(since), self._roads.area, settings)
            near.log_weight += total - near.log_total
            self._them = self._them.joined(near)
        self._claim.drop()
        self._astray.forget()
        self._past.clear()

    def interrupt(self, distance: float, *, turn: float = 0.0) -> None:
        """
        Report a gap, a cut or a reset of the odometry: the vehicle may have moved unseen.

        Parameters
        ----------
        distance
            Largest distance that the vehicle may have driven meanwhile, in metres.
        turn
            Standard deviation of the unseen change of the heading in radians; pi or more if
            nothing is known of it, as after a reset.

        Raises
        ------
        ValueError
            An argument is negative or not finite.

        """
        if not (0.0 <= distance < math.inf and turn >= 0.0):
            raise ValueError(
                f'the interruption is of {distance} m and {turn} rad: give numbers of 0 or more')
        settings, since = self._settings, self._odometer.since
        self._odometer.begin_again()
        self._past.clear()
        self._gate.forget()
        self._track.forget()
        self._astray.forget()
        # Some hypotheses stand for all. Each spreads over the roads that it may have reached.
        spread = self._seeding.spread(
            resampled(self._them, settings.spread_from, self._rng), since, distance + PIECE_M,
            turn, self._odometer)
        if len(spread):
            self._them = resampled(
                merged(spread, settings, self._rng), settings.most_hypotheses, self._rng)
        self._found = self._places.best(self._them, self._log_total())
        if self._found[0].probability < settings.drop_below:
            self._claim.drop()


@dataclass(frozen=True, slots=True)
class _Moment:
    """The hypotheses of a stride, unless they are too many, and what was known of it."""

    them: Hypotheses | None
    heading: float
    place: complex
    log_fit: float
