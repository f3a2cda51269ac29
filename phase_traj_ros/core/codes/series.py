# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A run-length encoded series of codes."""

from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, repeat
from typing import Any, Generic, TypeVar

from phase_traj_ros.core.codes.codes import Code

CodeT = TypeVar('CodeT', bound=Code)


@dataclass(frozen=True, slots=True)
class Run(Generic[CodeT]):
    """The same code, ``count`` times in a row."""

    code: CodeT
    count: int


class CodeSeries(Generic[CodeT]):
    """
    Codes in the order of arrival, run-length encoded.

    With ``max_runs`` only the newest runs are kept, so a series that flickers between two codes
    for days stays small. The length and the totals count every code ever appended.
    """

    def __init__(self, *, max_runs: int | None = None) -> None:
        """Make an empty series that keeps the newest ``max_runs`` runs, or all of them."""
        if max_runs is not None and max_runs < 1:
            raise ValueError(f'max_runs is {max_runs}: give at least 1')
        self._runs: deque[Run[CodeT]] = deque(maxlen=max_runs)
        self._totals: Counter[CodeT] = Counter()

    def append(self, code: CodeT) -> None:
        """Add one code at the end."""
        if self._runs and self._runs[-1].code is code:
            self._runs[-1] = Run(code, self._runs[-1].count + 1)
        else:
            self._runs.append(Run(code, 1))
        self._totals[code] += 1

    @property
    def runs(self) -> tuple[Run[CodeT], ...]:
        """Return the runs kept, oldest first."""
        return tuple(self._runs)

    def last_runs(self, count: int) -> tuple[Run[CodeT], ...]:
        """Return the newest ``count`` runs, oldest first."""
        first = max(len(self._runs) - count, 0)
        return tuple(self._runs[index] for index in range(first, len(self._runs)))

    def totals_of(self, codes: type[Code]) -> tuple[int, ...]:
        """Return how often each code of the type ``codes`` was appended, in ascending order."""
        counts: Mapping[Any, int] = self._totals
        return tuple(counts.get(code, 0) for code in sorted(codes))

    def __len__(self) -> int:
        """Return how many codes were appended, including those in discarded runs."""
        return self._totals.total()

    def __iter__(self) -> Iterator[CodeT]:
        """Iterate over the codes kept, oldest first."""
        return chain.from_iterable(repeat(run.code, run.count) for run in self._runs)
