# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The locator in its thread: nothing waits for it, and nothing is lost on the way."""

import threading

from phase_traj_ros.core.localization.given import OdometryStep, PositionFix
from phase_traj_ros.ros.location import worker as module
from phase_traj_ros.ros.location.worker import LocatorWorker, Moved
from phase_traj_ros.tasks.location.motion import Interruption
from phase_traj_ros.tasks.location.run import UNKNOWN
import pytest
from told_locator import ToldLocator

WAIT_S = 30.0


class SlowLocator(ToldLocator):
    """Waits in each step until it may go on."""

    def __init__(self):
        super().__init__((0.0, 0.0, 0.0), after=5.0)
        self.may_go_on = threading.Event()
        self.done = threading.Semaphore(0)

    def update(self, step):
        assert self.may_go_on.wait(WAIT_S)
        found = super().update(step)
        self.done.release()
        return found


@pytest.fixture
def slow():
    locator = SlowLocator()
    worker = LocatorWorker(locator)
    yield locator, worker
    locator.may_go_on.set()
    worker.close()


def moved(number):
    return Moved(number, (OdometryStep(stamp_ns=number, distance=1.0, yaw=0.0),))


def wait_for(locator, count):
    for _ in range(count):
        assert locator.done.acquire(timeout=WAIT_S)


def test_a_slow_step_delays_nobody_and_all_pairs_are_located(slow):
    locator, worker = slow
    for number in range(20):
        worker.add(moved(number))
    # The first step has not even begun to end.
    assert worker.take() == [] and worker.waiting >= 19

    locator.may_go_on.set()
    wait_for(locator, 20)
    worker.close()
    placed = worker.take()
    assert [pair.stamp_ns for pair, _ in placed] == list(range(20))
    assert [estimate.claimed for _, estimate in placed] == [False] * 4 + [True] * 16
    assert worker.take() == []


def test_fixes_come_in_their_turn_and_are_counted(slow):
    locator, worker = slow
    locator.may_go_on.set()
    worker.fix(PositionFix(1.0, 2.0, 4.0, 4.0))
    worker.add(moved(1))
    wait_for(locator, 1)

    assert locator.fixes == [PositionFix(1.0, 2.0, 4.0, 4.0)]
    assert (worker.fixes_used, worker.fixes_refused) == (1, 0)


def test_too_many_waiting_pairs_are_an_interruption(slow, monkeypatch):
    locator, worker = slow
    monkeypatch.setattr(module, '_MOST_WAITING', 5)
    for number in range(30):
        worker.add(moved(number))
    left_out = worker.left_out
    assert left_out >= 24
    locator.may_go_on.set()
    wait_for(locator, 30 - left_out)
    worker.add(moved(30))
    wait_for(locator, 1)

    assert len(locator.interruptions) == 1
    assert worker.failure is None


def test_an_interruption_has_no_place(slow):
    locator, worker = slow
    locator.may_go_on.set()
    worker.add(Moved(1, (Interruption(50.0, 1.0),)))
    worker.add(moved(2))
    wait_for(locator, 1)
    worker.close()

    assert [estimate is UNKNOWN for _, estimate in worker.take()] == [True, False]
    assert locator.interruptions == [(50.0, 1.0)]


def test_a_failing_locator_ends_only_its_thread():
    class Failing(ToldLocator):

        def update(self, step):
            raise ValueError('broken')

    worker = LocatorWorker(Failing((0.0, 0.0, 0.0)))
    worker.add(moved(1))
    worker._thread.join(WAIT_S)
    worker.close()
    worker.add(moved(2))

    assert str(worker.failure) == 'broken' and worker.take() == []
