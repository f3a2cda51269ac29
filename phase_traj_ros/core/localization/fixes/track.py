# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The last seconds of the odometry, which give the pose at the stamp of a position fix."""

from collections import deque

import numpy as np

# A fix may be this much older than the newest pose of the odometry, or this much newer.
_KEPT_NS, _AHEAD_NS = 5_000_000_000, 1_000_000_000


def check_age(age_ns: int) -> None:
    """
    Check the age of a fix: the stamp of the newest pose of the odometry minus that of the fix.

    Raises
    ------
    ValueError
        The fix is more than 5 s old, or more than 1 s ahead.

    """
    if not -_AHEAD_NS <= age_ns <= _KEPT_NS:
        raise ValueError(
            f'its stamp is {abs(age_ns) * 1e-9:.1f} s {"before" if age_ns > 0 else "after"} that'
            f' of the newest frame: at most {_KEPT_NS * 1e-9:.0f} s before and'
            f' {_AHEAD_NS * 1e-9:.0f} s after are used, on the clock of the images')


class Track:
    """The positions of the odometry in the last 5 s, by stamp."""

    def __init__(self) -> None:
        """Make an empty track."""
        self._past: deque[tuple[int, complex, float]] = deque()

    def reset(self) -> None:
        """Delete all positions: the odometry was interrupted."""
        self._past.clear()

    def add(self, stamp_ns: int, position: complex, travelled: float) -> None:
        """
        Append a position of the odometry, and the metres travelled up to it.

        A stamp before the last one deletes the earlier positions: the clock was set back.
        """
        past = self._past
        if past and stamp_ns < past[-1][0]:
            past.clear()
        if past and stamp_ns == past[-1][0]:
            past.pop()
        past.append((stamp_ns, position, travelled))
        while len(past) > 1 and stamp_ns - past[1][0] >= _KEPT_NS:
            past.popleft()

    def at(self, stamp_ns: int) -> tuple[complex, float]:
        """
        Return the position and the metres travelled at a stamp.

        Interpolates between positions. After the newest one, extrapolates by mirroring the track
        at it.

        Raises
        ------
        ValueError
            The track is empty or begins after the stamp, or the stamp is too old or too new.

        """
        past = self._past
        if not past:
            raise ValueError('there is no pose yet')
        newest, position, travelled = past[-1]
        check_age(newest - stamp_ns)
        if stamp_ns > newest:
            mirrored, travelled_there = self.at(2 * newest - stamp_ns)
            return 2 * position - mirrored, 2 * travelled - travelled_there
        if stamp_ns < past[0][0]:
            raise ValueError('its stamp is before the first pose')
        stamps, positions, distances = zip(*past)
        # Stamps have more digits than floats.
        ages = [stamp - newest for stamp in stamps]
        return (complex(np.interp(stamp_ns - newest, ages, positions)),
                float(np.interp(stamp_ns - newest, ages, distances)))
