# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The results of all pairs of a drive, in a tenth of the memory that they take as objects."""

from collections.abc import Sequence
from functools import lru_cache
import operator
import pickle
from typing import overload
import zlib

from phase_traj_ros.core import Update

_BLOCK, _OPEN = 1024, 2


class KeptUpdates(Sequence[Update]):
    """
    A sequence of updates that grows.

    They are compressed in blocks of 1,024 pairs, of which the two read last are kept as objects
    too.
    """

    def __init__(self) -> None:
        """Keep nothing."""
        self._blocks: list[bytes] = []
        self._rest: list[Update] = []
        self._open = lru_cache(maxsize=_OPEN)(self._unpack)

    def append(self, update: Update) -> None:
        """Keep one more."""
        self._rest.append(update)
        if len(self._rest) == _BLOCK:
            # The fastest level: the next one saves little more.
            self._blocks.append(zlib.compress(pickle.dumps(self._rest, -1), 1))
            self._rest = []

    def __len__(self) -> int:
        return len(self._blocks) * _BLOCK + len(self._rest)

    @overload
    def __getitem__(self, index: int) -> Update: ...

    @overload
    def __getitem__(self, index: slice) -> list[Update]: ...

    def __getitem__(self, index: int | slice) -> Update | list[Update]:
        if isinstance(index, slice):
            return [self[each] for each in range(len(self))[index]]
        block, place = divmod(range(len(self))[operator.index(index)], _BLOCK)
        return (self._open(block) if block < len(self._blocks) else self._rest)[place]

    def _unpack(self, block: int) -> list[Update]:
        found: list[Update] = pickle.loads(zlib.decompress(self._blocks[block]))
        return found
