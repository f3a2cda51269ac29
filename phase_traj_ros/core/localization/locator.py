# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates an odometry on a road map."""

import cmath
from collections import deque
from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.core.localization.fixes import (
    FixGate,
    log_likelihood,
    radius_of,
    Verdict,
)
from phase_traj_ros.core.localization.given import OdometryStep, PositionFix, Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import Hypotheses, merged, pruned, resampled
from phase_traj_ros.core.localization.likelihood import judge
from phase_traj_ros.core.localization.motion import Motion
from phase_traj_ros.core.localization.places import Astray, Claim, Place, Places
from phase_traj_ros.core.localization.roads import PIECE_M, RoadMap
from phase_traj_ros.core.localization.seeding import ExpectedPose, Seeding, spread_of
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer, Stride

# The first turn is over when the chord bends less than this, after it bent more.
_TURNING, _STRAIGHT = math.radians(40.0), math.radians(12.0)
# Share of the prior's spread below which something has told the scale.
_TOLD = 0.7
# Strides within which a U-turn is one, and how much it may differ from half a circle.
_U_TURN_STRIDES, _U_TURN = 7, math.radians(30.0)


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
            Where on the map the vehicle starts; None for anywhere, if it is on it at all: then it
            has to fit well enough to be no chance.
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
        self._area = roads.area
        self._rng = np.random.default_rng(seed)
        self._seeding = Seeding(roads, self._scale, self._settings, self._rng)
        self._motion = Motion(roads, self._scale, self._settings)
        self._places = Places(roads, self._settings)
        self._odometer = Odometer(
            self._settings.stride_m / self._scale.middle, self._settings.chord_strides)
        self._claim = Claim(self._settings)
        self._astray = Astray(self._settings)
        self._gate = FixGate(self._settings)
        if prior is None:
            self._them = self._seeding.anywhere(self._odometer, 0.0)
        else:
            self._them = self._seeding.around(prior, self._odometer, 0.0)
            self._them.evidence[:] = self._settings.most_evidence
        self._strides = 0
        self._way = self._seeded = self._best_fit = 0.0
        self._turning = self._turned = False
        self._past: deque[_Moment] = deque(maxlen=_U_TURN_STRIDES)
        self._found = self._places.best(self._them)

    def update(self, step: OdometryStep) -> LocationEstimate:
        """
        Take the next step of the odometry; return the place after it.

        The hypotheses are judged every 5 m. Steps between only move the last estimate.
        """
        stride = self._odometer.add(step)
        if stride is not None:
            self._follow(stride)
        return self._estimate(step.stamp_ns)

    def _follow(self, stride: Stride) -> None:
        """Move and judge the hypotheses by a stride."""
        settings, metres = self._settings, stride.distance * self._scale.middle
        most = self._most()
        self._strides += 1
        self._way += metres
        error = settings.bend_error_claimed if self._claim.held else settings.bend_error
        them = self._motion.advance(self._them, stride, most, self._rng)
        self._best_fit += judge(them, stride, settings, error)
        self._them = self._turned_back(them, stride, most)
        self._seed_sometimes()
        them = merged(pruned(self._them, settings), settings, self._rng)
        them = resampled(them, most, self._rng)
        self._them = self._split(them, stride, most)
        self._found = self._places.best(self._them)
        self._claim.follow(self._found[0], metres)
        if self._claim.held and self._astray.follow(
                self._found[0], self._odometer.place, self._way):
            # The vehicle may be on no road as well.
            self._doubt_all()
            self._seeded = self._way
            self._claim.drop()

    def _doubt_all(self) -> None:
        """Doubt that the vehicle is on the roads of the map."""
        self._them.evidence = np.minimum(self._them.evidence, self._settings.return_evidence)

    def _seed_sometimes(self) -> None:
        """Let vehicles on no road of the map come back to one."""
        settings = self._settings
        total = self._them.log_total + math.log(max(self._off_road(), 1e-9))
        if self._astray.is_lost:
            near = self._seeding.expected(
                self._astray.expected(self._odometer.place, self._way), self._odometer,
                total + math.log(settings.return_hazard))
            if near is not None:
                near.evidence[:] = settings.return_evidence
                self._them = self._them.joined(near)
        if not self._claim.held and self._way - self._seeded > settings.reseed_every_m:
            self._seeded = self._way
            self._them = self._them.joined(self._seeding.anywhere(
                self._odometer, total + math.log(settings.return_anywhere)))

    def _turned_back(self, them: Hypotheses, stride: Stride, most: int) -> Hypotheses:
        """Return the hypotheses and, after a U-turn, also those that turned back on their road."""
        settings, odometer = self._settings, self._odometer
        before = self._past[0] if len(self._past) == self._past.maxlen else None
        self._past.append(_Moment(
            self._them if len(self._them) <= settings.most_hypotheses else None,
            stride.heading, odometer.place, self._best_fit))
        if before is None or before.them is None or not len(before.them):
            return them
        turned = abs(abs(stride.heading - before.heading) - math.pi)
        if turned > _U_TURN or stride.bend > math.pi / 2:
            return them
        self._past.clear()
        back = self._motion.turned_back(before.them, odometer.place - before.place, most)
        back.log_weight = back.log_weight + (
            math.log(settings.turn_back) + self._best_fit - before.best_fit)
        return them.joined(self._seeding.retraced(back, odometer))

    def _most(self) -> int:
        started = self._strides >= self._settings.start_strides
        return self._settings.most_hypotheses if started else self._settings.most_at_start

    def _split(self, them: Hypotheses, stride: Stride, most: int) -> Hypotheses:
        """
        Return more hypotheses where there are few.

        After the first turn the place is one of few, and the way since tells the scale: there,
        many scales are tried for each.
        """
        settings = self._settings
        self._turning = self._turning or stride.bend > _TURNING
        first = self._turning and not self._turned and stride.bend < _STRAIGHT
        if first:
            self._turned = True
            first = self._scale_is_unknown(them)
        if first:
            copies = min(settings.scales_after_turn, max(most // max(len(them), 1), 1))
        else:
            fewest = settings.fewest_hypotheses if self._claim.held else min(
                settings.fewest_searching, 2 * len(self._roads))
            copies = fewest // max(len(them), 1)
        if copies < 2:
            return them
        them = them.take(np.repeat(np.arange(len(them)), copies))
        them.log_weight -= math.log(copies)
        if first:
            them.log_scale = self._seeding.prior_scales(len(them))
        return them

    def _scale_is_unknown(self, them: Hypotheses) -> bool:
        """Return whether the scales spread as in the prior: gentle bends may have told them."""
        weight = np.exp(them.log_weight - them.log_total)
        mean = (weight * them.log_scale).sum()
        variance = float((weight * (them.log_scale - mean) ** 2).sum())
        return variance > (_TOLD * spread_of(self._scale)) ** 2

    def _estimate(self, stamp_ns: int) -> LocationEstimate:
        place, odometer = self._found[0], self._odometer
        middle = self._now(place)
        one, two, three = place.covariance.tolist()
        scale = math.exp(place.log_scale)
        return LocationEstimate(
            stamp_ns=stamp_ns, claimed=self._claim.held, x=middle.real, y=middle.imag,
            heading=math.remainder(odometer.heading + place.turned, math.tau),
            probability=min(place.probability, 1.0),
            covariance=(tuple(one), tuple(two), tuple(three)), scale=scale,
            scale_deviation=scale * place.scale_deviation,
            candidates=tuple(map(self._candidate, self._found)),
            off_road=self._off_road())

    def _off_road(self) -> float:
        """Return the probability of being on no road of the map."""
        them = self._them
        weight = np.exp(them.log_weight - them.log_total)
        return max(1.0 - float((weight * them.reality).sum()), 0.0)

    def _now(self, place: Place) -> complex:
        """Return where a place of the last stride is at the newest pose."""
        return place.middle + self._odometer.since * cmath.exp(
            complex(place.log_scale, place.turned))

    def _candidate(self, place: Place) -> Candidate:
        middle = self._now(place)
        return Candidate(
            middle.real, middle.imag,
            math.remainder(self._odometer.heading + place.turned, math.tau),
            min(place.probability, 1.0))

    def fix(self, fix: PositionFix) -> bool:
        """
        Take a position at the newest pose; return whether it was used.

        A fix that contradicts the claimed place, its own covariance and the odometry since is
        not used, unless the next ones agree with it. A fix that comes less than 5 m after the last
        one is not used either: successive fixes share their errors. One that agrees is evidence
        that the place was not found by chance.
        """
        place = self._found[0]
        way = self._way + abs(self._odometer.since) * self._scale.middle
        verdict = self._gate.judge(
            fix, way, self._now(place) if self._claim.held else None, place.covariance[:2, :2])
        if verdict is Verdict.IGNORED:
            return False
        if verdict is Verdict.TRUSTED:
            self._start_again_at(fix)
        else:
            self._weigh(fix)
        self._found = self._places.best(self._them)
        return True

    def _weigh(self, fix: PositionFix) -> None:
        """Weigh the hypotheses by a fix; its errors are as correlated as those of chords."""
        settings, them = self._settings, self._them
        now = them.places + self._odometer.since * np.exp(them.log_scale + 1j * them.turned)
        fit = settings.tempering * log_likelihood(fix, now, self._area, settings)
        them.log_weight = them.log_weight + fit
        # A place that was found by chance may be anywhere.
        them.evidence = np.minimum(
            them.evidence + fit + settings.tempering * math.log(self._area),
            settings.most_evidence)

    def _start_again_at(self, fix: PositionFix) -> None:
        """Believe that the vehicle is where a fix is, but for a doubt."""
        settings, total = self._settings, self._them.log_total
        self._them.log_weight = self._them.log_weight + math.log(settings.fix_outliers)
        self._doubt_all()
        prior = Prior(fix.x, fix.y, 3.0 * math.hypot(radius_of(fix), settings.fix_road_m))
        if self._roads.distance_to(fix.x, fix.y) <= prior.radius:
            near = self._seeding.around(prior, self._odometer, total)
            near.log_weight = near.log_weight + log_likelihood(
                fix, near.places, self._area, settings)
            near.log_weight += total - near.log_total
            near.evidence[:] = settings.return_evidence
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
        self._astray.forget()
        # Some hypotheses stand for all. Each spreads over the roads that it may have reached.
        some = resampled(self._them, settings.spread_from, self._rng)
        middles = some.places + since * np.exp(some.log_scale + 1j * some.turned)
        them = self._them.take(np.empty(0, np.int64))
        for number, middle in enumerate(middles):
            near = self._seeding.expected(
                ExpectedPose(
                    complex(middle), float(some.turned[number]),
                    math.hypot(turn, math.sqrt(some.variance[number])),
                    distance + PIECE_M, float(some.log_scale[number])),
                self._odometer, float(some.log_weight[number]))
            if near is not None:
                near.evidence[:] = some.evidence[number]
                them = them.joined(near)
        if len(them):
            self._them = resampled(
                merged(them, settings, self._rng), settings.most_hypotheses, self._rng)
        self._found = self._places.best(self._them)
        if self._found[0].probability < settings.drop_below:
            self._claim.drop()


@dataclass(frozen=True, slots=True)
class _Moment:
    """The hypotheses of a stride, unless they are too many, and what was known of it."""

    them: Hypotheses | None
    heading: float
    place: complex
    best_fit: float
