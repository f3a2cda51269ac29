# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which time an image message was taken at."""

from typing import Protocol


class Time(Protocol):
    """The fields of builtin_interfaces/Time."""

    @property
    def sec(self) -> int:
        """Whole seconds."""

    @property
    def nanosec(self) -> int:
        """Nanoseconds behind them."""


def to_nanoseconds(time: Time) -> int:
    """Return a ROS time in nanoseconds."""
    return time.sec * 1_000_000_000 + time.nanosec


class StampRule:
    """
    Decide between the header's stamp and the receive time of each message of one camera.

    Some drivers leave all stamps zero. A single zero is believed (simulated time starts there);
    from the second zero in a row on, the time at which the message was received is used, until a
    stamp is not zero. A reader that can look ahead and has found that the stream starts with two
    zeros says so with zero_seen, and the first message gets its receive time, too.
    """

    def __init__(self, *, zero_seen: bool = False) -> None:
        self._zero_seen = zero_seen

    def stamp_ns(self, header_stamp_ns: int, receive_ns: int) -> int:
        """Return the stamp to use for the next message, in nanoseconds."""
        if header_stamp_ns != 0:
            self._zero_seen = False
            return header_stamp_ns
        if self._zero_seen:
            return receive_ns
        self._zero_seen = True
        return header_stamp_ns
