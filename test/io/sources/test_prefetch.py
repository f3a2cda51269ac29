# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reading ahead keeps order and errors, is bounded, and stops when the reader does."""

import threading

from phase_traj_ros.io import prefetch
import pytest

PATIENCE = 30.0
DEPTH = 4


def no_thread_left():
    return all(not thread.name.startswith('prefetch') for thread in threading.enumerate())


@pytest.mark.parametrize('count', [0, 1, 7, 100])
def test_order(count):
    assert list(prefetch(iter(range(count)))) == list(range(count))
    assert no_thread_left()


def test_items_may_be_none_or_errors():
    error = ValueError('an item')
    assert list(prefetch([None, error, StopIteration])) == [None, error, StopIteration]


def test_fetches_while_the_caller_works():
    second_fetched = threading.Event()
    threads = set()

    def source():
        threads.add(threading.current_thread())
        yield 1
        second_fetched.set()
        yield 2

    items = prefetch(source())
    assert next(items) == 1
    assert second_fetched.wait(PATIENCE), 'the second item must not wait for the caller'
    assert list(items) == [2]
    assert threading.current_thread() not in threads


@pytest.mark.parametrize('taken', [1, 4])
def test_bounded(taken):
    fetched = []
    enough = threading.Event()

    def source():
        for index in range(1000):
            fetched.append(index)
            if len(fetched) == taken - 1 + DEPTH:
                enough.set()
            yield index

    items = prefetch(source())
    assert [next(items) for _ in range(taken)] == list(range(taken))
    # As many as allowed are fetched and, as is certain after the thread has ended, no more.
    assert enough.wait(PATIENCE)
    items.close()
    assert no_thread_left()
    assert len(fetched) == taken - 1 + DEPTH


class BrokenError(Exception):
    """The error of a source."""


def broken_source():
    yield 1
    yield 2
    raise BrokenError


def test_error_comes_in_its_turn():
    items = prefetch(broken_source())
    assert [next(items), next(items)] == [1, 2]
    with pytest.raises(BrokenError) as caught:
        next(items)
    # With its traceback.
    assert any(entry.name == 'broken_source' for entry in caught.traceback)
    assert no_thread_left()
    assert list(items) == []


def test_error_of_iter():
    class Source:
        """Fails at the start of the iteration."""

        def __iter__(self):
            raise BrokenError

    with pytest.raises(BrokenError):
        next(prefetch(Source()))
    assert no_thread_left()


@pytest.mark.parametrize('end', ['close', 'drop', 'break', 'throw', 'exhaust'])
def test_source_is_closed_in_its_own_thread(end):
    seen = {}

    def source():
        seen['opened'] = threading.get_ident()
        try:
            yield from range(1000 if end != 'exhaust' else 3)
        finally:
            seen['closed'] = threading.get_ident()

    items = prefetch(source())
    next(items)
    if end == 'close':
        items.close()
    elif end == 'drop':
        del items
    elif end == 'break':
        for _ in items:
            break
        del _, items
    elif end == 'throw':
        with pytest.raises(BrokenError):
            items.throw(BrokenError())
    else:
        list(items)
    assert no_thread_left()
    assert seen['opened'] == seen['closed'] != threading.get_ident()


def test_not_started_before_the_first_item():
    items = prefetch(broken_source())
    assert no_thread_left()
    items.close()
