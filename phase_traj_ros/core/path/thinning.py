# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Limits the length of a growing series by thinning it evenly."""

from typing import Generic, TypeVar

Item = TypeVar('Item')


class Thinned(Generic[Item]):
    """
    Keeps every n-th offered item, in order, at most ``limit`` of them.

    n starts at 1. When the limit is exceeded, every second item is dropped, and n doubles.
    """

    def __init__(self, limit: int | None) -> None:
        """Keep at most ``limit`` items, 1 or more; None keeps all."""
        self._limit = limit
        self.clear()

    def clear(self) -> None:
        """Drop all items."""
        self._kept: list[Item] = []
        self._every = 1
        self._offered = 0

    @property
    def wants_next(self) -> bool:
        """Return whether the next item would be kept, to avoid making it otherwise."""
        return self._offered % self._every == 0

    def offer(self, item: Item | None) -> None:
        """Offer the next item; it may be None unless ``wants_next``."""
        if self.wants_next:
            assert item is not None
            self._kept.append(item)
        self._offered += 1
        if self._limit is not None and len(self._kept) > self._limit:
            self.thin()

    def thin(self) -> None:
        """Drop every second item."""
        self._kept = self._kept[::2]
        self._every *= 2

    @property
    def kept(self) -> tuple[Item, ...]:
        """Return the kept items, oldest first."""
        return tuple(self._kept)
