# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Selects the time of an image message."""

from typing import Any

STAMPS_END_NS = 2**31 * 10**9
"""The first stamp after the last that a builtin_interfaces/Time can hold, in nanoseconds."""


def to_nanoseconds(time: Any) -> int:
    """Return a builtin_interfaces/Time of any library in nanoseconds."""
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)


class StampRule:
    """
    Selects the header's stamp or the receive time for each message of one camera.

    Some drivers leave all stamps zero. From the second zero on, the receive time is used, as long
    as no stamp was anything else. A single zero is passed on (simulated time starts there), and so
    are zeros of a camera that had stamps: ``StampGate`` drops them, unless a loop goes on from
    there. A reader that can look ahead and finds two zeros at the start of the stream sets
    zero_seen; the first message then gets its receive time too.
    """

    def __init__(self, *, zero_seen: bool = False) -> None:
        self._zero_seen = zero_seen
        self._stamped = False

    def stamp_ns(self, header_stamp_ns: int, receive_ns: int) -> int:
        """Return the stamp to use for the next message, in nanoseconds."""
        if header_stamp_ns != 0:
            self._stamped = True
        if self._stamped:
            return header_stamp_ns
        if self._zero_seen:
            return receive_ns
        self._zero_seen = True
        return header_stamp_ns
