# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads ahead in a background thread."""

from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

ItemT = TypeVar('ItemT')

_DEPTH = 4
_END = object()


def prefetch(items: Iterable[ItemT]) -> Generator[ItemT, None, None]:
    """
    Yield the items in order, while a background thread fetches up to four of them ahead.

    This helps if fetching releases the interpreter lock, as decoding in OpenCV does. An error of
    the iterable is raised when its turn comes. Closing or deleting the generator stops the thread
    after the current item, closes the iterator in that thread (no other one uses it), and waits
    until this is done.
    """
    with ThreadPoolExecutor(1, 'prefetch') as thread:
        iterator = thread.submit(iter, items).result()
        ahead: deque[Future[Any]] = deque(
            thread.submit(next, iterator, _END) for _ in range(_DEPTH))
        try:
            while (item := ahead.popleft().result()) is not _END:
                yield item
                del item
                ahead.append(thread.submit(next, iterator, _END))
        finally:
            for each in ahead:
                each.cancel()
            if isinstance(iterator, Generator):
                thread.submit(iterator.close).result()
