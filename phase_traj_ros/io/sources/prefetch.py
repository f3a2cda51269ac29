# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads ahead in a background thread."""

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from queue import SimpleQueue
from threading import Event, Semaphore, Thread
from typing import Generic, TypeVar

ItemT = TypeVar('ItemT')


@dataclass(frozen=True, slots=True)
class _Item(Generic[ItemT]):
    value: ItemT


@dataclass(frozen=True, slots=True)
class _End:
    error: BaseException | None


def prefetch(items: Iterable[ItemT], depth: int = 4) -> Generator[ItemT, None, None]:
    """
    Yield the items in order, while a background thread fetches up to depth of them ahead.

    This helps if fetching releases the interpreter lock, as decoding in OpenCV does. An error of
    the iterable is raised when its turn comes. Closing or deleting the generator stops the thread
    after the current item, closes the iterator in that thread (no other one uses it), and waits
    until this is done.

    Raises ValueError, at the first item, if depth is less than 1.
    """
    if depth < 1:
        raise ValueError(f'depth must be at least 1, not {depth}')
    queue: SimpleQueue[_Item[ItemT] | _End] = SimpleQueue()
    free = Semaphore(depth)
    abandoned = Event()

    def fetch() -> None:
        error: BaseException | None = None
        try:
            iterator = iter(items)
            try:
                while True:
                    free.acquire()
                    if abandoned.is_set():
                        break
                    try:
                        value = next(iterator)
                    except StopIteration:
                        break
                    queue.put(_Item(value))
                    del value
            finally:
                if isinstance(iterator, Generator):
                    iterator.close()
        except BaseException as caught:
            error = caught
        queue.put(_End(error))

    # A daemon: a generator that is still alive when the interpreter exits must not keep it
    # from exiting.
    thread = Thread(target=fetch, name='prefetch', daemon=True)
    thread.start()
    try:
        while True:
            entry = queue.get()
            if isinstance(entry, _End):
                if entry.error is not None:
                    raise entry.error
                return
            yield entry.value
            del entry
            free.release()
    finally:
        abandoned.set()
        free.release()
        thread.join()
