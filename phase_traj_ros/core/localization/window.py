# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The last strides of the odometer, and its last seconds: what is compared with the map."""

import cmath
from collections import deque
from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.given import OdometryStep
from phase_traj_ros.core.localization.roads import Complexes, Floats

# A position may be so much older than the newest pose of the odometry, or so much newer.
_KEPT_NS, _AHEAD_NS = 5_000_000_000, 1_000_000_000


@dataclass(frozen=True, slots=True)
class Stride:
    """
    One stride of the odometer and the chord that ends with it, in the axes of the odometry.

    distance
        Distance along the path, in the unit of the odometry.
    distance_variance, yaw_variance
        Variances of the distance and of the change of the heading since the last stride.
    scale_variance
        Variance of the change of the logarithm of the scale since the last stride.
    heading
        Heading at the end, in radians.
    chord, bend
        Direction of the chord over the last strides, and how much they bend, in radians.
    turned
        Change of the direction since the chord before.
    """

    distance: float
    distance_variance: float
    yaw_variance: float
    scale_variance: float
    heading: float
    chord: float
    bend: float
    turned: float


class Odometer:
    """Sums steps of the odometry up to strides of equal length."""

    def __init__(self, stride: float, strides: int) -> None:
        """Make an odometer at the origin; ``stride`` is in the unit of the odometry."""
        self._stride = stride
        self._strides = strides
        self.heading = 0.0
        """Heading in radians since the start, not wrapped."""
        self.place = 0j
        """Place at the last stride, in the axes and the unit of the odometry."""
        self.since = 0j
        """Displacement since then."""
        self.trail: Complexes
        """Ends of the last strides and start of the first, the oldest first, from the newest."""
        self.begin_again()

    def begin_again(self) -> None:
        """Forget the trail and the stride: what came before does not belong to what follows."""
        self.place += self.since
        along = np.complex128(cmath.rect(self._stride, self.heading))
        self.trail = along * np.arange(-self._strides, 1)
        self._chord = self.heading
        self._begin_stride()

    def _begin_stride(self) -> None:
        self.since = 0j
        self._distance = self._distance_variance = 0.0
        self._yaw_variance = self._scale_variance = 0.0

    def add(self, step: OdometryStep) -> Stride | None:
        """Take the next step; return the stride that ends with it, if one does."""
        self.since += cmath.rect(step.distance, self.heading + step.yaw / 2)
        self.heading += step.yaw
        self._distance += step.distance
        self._distance_variance += step.distance_variance
        self._yaw_variance += step.yaw_variance
        self._scale_variance += step.scale_variance
        if self._distance < self._stride:
            return None
        self.place += self.since
        self.trail = np.append(self.trail[1:], self.since) - self.since
        across = complex(-self.trail[0])
        # A vehicle that has gone back and forth may be where it was.
        chord = cmath.phase(across) if across else self._chord
        turned = math.remainder(chord - self._chord, math.tau)
        self._chord = chord
        stride = Stride(
            self._distance, self._distance_variance, self._yaw_variance, self._scale_variance,
            self.heading, chord, float(bend_of(self.trail)), turned)
        self._begin_stride()
        return stride


def bend_of(trail: Complexes) -> Floats:
    """Return how much trails bend in all, in radians; the first axis is that of their places."""
    parts = np.diff(trail, axis=0)
    bend: Floats = np.abs(np.angle(parts[1:] * parts[:-1].conj())).sum(axis=0)
    return bend


def check_age(age_ns: int) -> None:
    """
    Check the age of a position, from its stamp to that of the newest pose of the odometry.

    Raises
    ------
    ValueError
        It is too old, or too far ahead.

    """
    if not -_AHEAD_NS <= age_ns <= _KEPT_NS:
        raise ValueError(
            f'its stamp is {abs(age_ns) * 1e-9:.1f} s {"before" if age_ns > 0 else "after"} that'
            f' of the newest frame: at most {_KEPT_NS * 1e-9:.0f} s before and'
            f' {_AHEAD_NS * 1e-9:.0f} s after are used, on the clock of the images')


class Track:
    """The last seconds of the odometry: where the vehicle was at a stamp."""

    def __init__(self) -> None:
        """Know nothing."""
        self._past: deque[tuple[int, complex, float]] = deque()

    def forget(self) -> None:
        """Know nothing again: the odometry was interrupted."""
        self._past.clear()

    def add(self, stamp_ns: int, place: complex, way: float) -> None:
        """Take a place of the odometry, and the metres travelled until there."""
        past = self._past
        if past and stamp_ns < past[-1][0]:
            past.clear()
        if past and stamp_ns == past[-1][0]:
            past.pop()
        past.append((stamp_ns, place, way))
        while len(past) > 1 and stamp_ns - past[1][0] >= _KEPT_NS:
            past.popleft()

    def at(self, stamp_ns: int) -> tuple[complex, float]:
        """
        Return the place and the metres travelled at a stamp.

        From the newest pose on, the vehicle goes on as it has come there.

        Raises
        ------
        ValueError
            The stamp is too old or too new, or nothing is known of so long ago.

        """
        past = self._past
        if not past:
            raise ValueError('there is no pose yet')
        newest, place, way = past[-1]
        check_age(newest - stamp_ns)
        if stamp_ns > newest:
            before, way_before = self.at(2 * newest - stamp_ns)
            return 2 * place - before, 2 * way - way_before
        if stamp_ns < past[0][0]:
            raise ValueError('its stamp is before the first pose')
        stamps, places, ways = zip(*past)
        # Stamps have more digits than floats.
        ages = [stamp - newest for stamp in stamps]
        return (complex(np.interp(stamp_ns - newest, ages, places)),
                float(np.interp(stamp_ns - newest, ages, ways)))
