# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Accounting of what came and how long it took."""

from phase_traj_ros.ros.health import Health, LossCounter, Stage
import pytest


@pytest.mark.parametrize(('numbers', 'lost'), [
    ([], 0), ([5], 0), ([1, 2, 3], 0), ([1, 2, 5, 6], 2), ([1, 100], 98),
    ([9, 10, 1, 2, 5], 2),       # the publisher has started anew
    ([1, 10**6, 10**6 + 1], 0),  # another publisher
    ([None, None, None], 0),     # a middleware that does not number its messages
])
def test_losses_are_gaps_in_the_numbers(numbers, lost):
    counter = LossCounter(lambda: 1)
    assert sum(counter.update(number) for number in numbers) == lost


@pytest.mark.parametrize('begin', [39_000, 105, 7])
def test_no_loss_is_made_up_where_two_publish(begin):
    counter = LossCounter(lambda: 2)
    numbers = [number for index in range(40) for number in (7 + index, begin + index)]
    assert not any(map(counter.update, numbers))


def test_losses_are_counted_when_a_publisher_has_gone():
    publishers = 2
    counter = LossCounter(lambda: publishers)
    for number in (1, 500, 2, 501):
        assert counter.update(number) == 0
    publishers = 1
    assert [counter.update(number) for number in (502, 503, 507, 1, 2, 4)] == [0, 0, 3, 0, 0, 1]


def test_rate_follows_the_newest_images_and_falls_when_they_stop():
    health = Health()
    assert health.rate(0) == 0.0
    for index in range(300):
        health.arrived(index * 50_000_000, lost=0)
    now = 299 * 50_000_000
    assert health.rate(now) == pytest.approx(20)
    assert health.rate(now + 10**10) < 10


def test_times():
    health = Health()
    assert (health.microseconds(Stage.CODE), health.milliseconds(0.99)) == (0.0, 0.0)
    for index in range(1, 101):
        health.took(Stage.CODE, index * 1000)
        health.took_in_all(index * 1_000_000)
    assert health.microseconds(Stage.CODE) == pytest.approx(50.5)
    assert health.milliseconds(0.5) == pytest.approx(51)
    assert health.milliseconds(0.99) == pytest.approx(100)


def test_figures_are_bounded():
    health = Health()
    for index in range(5000):
        health.arrived(index, lost=1)
        health.took(Stage.CODE, index)
        health.took_in_all(index)
        health.responses.append(0.1)
    assert (health.images, health.lost) == (5000, 5000)
    assert health.microseconds(Stage.CODE) > 4
    assert len(health.responses) == 1000


def test_each_fault_is_taken_once():
    health = Health()
    health.arrived(0, lost=3)
    health.rejected('dark')
    assert health.take_faults() == (1, 3)
    health.rejected('dark')
    assert health.take_faults() == (1, 0)
    assert health.take_faults() == (0, 0)
