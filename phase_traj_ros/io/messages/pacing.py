# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""When something that changes all the time goes out."""


class Pace:
    """Lets news out at once, but at most once a period; times are of any one clock."""

    def __init__(self, period_ns: int) -> None:
        """Make a pace that has let nothing out yet."""
        self._period_ns = period_ns
        self._due_ns: int | None = None
        self._pending = False

    def changed(self) -> None:
        """Note that there is news."""
        self._pending = True

    def sent(self, now_ns: int) -> None:
        """Note that all there is has gone out."""
        self._pending = False
        self._due_ns = now_ns + self._period_ns

    @property
    def pending(self) -> bool:
        """Return whether there is news that has not gone out."""
        return self._pending

    def is_due(self, now_ns: int) -> bool:
        """Return whether there is news and it may go out now."""
        return self._pending and (self._due_ns is None or now_ns >= self._due_ns)
