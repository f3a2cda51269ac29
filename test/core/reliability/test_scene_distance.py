# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A road that slows down while the scene passes as before."""

from phase_traj_ros.core import Travel, TravelState
from phase_traj_ros.core.reliability.scene_distance import SceneDistance
import pytest


class Drive:
    """A drive past objects at a distance, and the seconds in which the road contradicts them."""

    def __init__(self, rate=10.0):
        self.scene, self.interval, self.seconds, self.doubted = SceneDistance(), 1 / rate, 0.0, []

    def go(self, seconds, *, road, passing, state=TravelState.MEASURED):
        """Drive; the speed by the road and the ratio of speed to distance, from and to a value."""
        count = round(seconds / self.interval)
        for number in range(count):
            along = (number + 0.5) / count
            speed, rate = (
                each if isinstance(each, float) else each[0] + along * (each[1] - each[0])
                for each in (road, passing))
            travel = Travel(speed * self.interval, 0.01, state)
            self.seconds += self.interval
            if self.scene.contradicts(travel, rate * self.interval, self.interval):
                self.doubted.append(self.seconds)
        return self


@pytest.mark.parametrize('rate', [5.0, 10.0, 30.0])
def test_a_road_that_slows_down_alone_is_doubted(rate):
    drive = Drive(rate).go(10, road=10.0, passing=1.0).go(5, road=1.2, passing=1.0)
    begin, end = drive.doubted[0], drive.doubted[-1]
    assert 10.8 < begin < 12.4
    assert end == pytest.approx(15)
    drive.go(5, road=10.0, passing=1.0)
    assert drive.doubted[-1] < 16


def test_so_is_one_that_runs_backwards_or_rests():
    for road in (0.0, -3.0):
        assert Drive().go(10, road=10.0, passing=1.0).go(5, road=road, passing=1.0).doubted


@pytest.mark.parametrize('plan', [
    # It brakes to a stop, and starts again.
    [(10.0, 1.0), ((10.0, 0.0), (1.0, 0.0)), ((0.0, 10.0), (0.0, 1.0))],
    # Into a narrow lane, at half the speed, past walls at half the distance.
    [(10.0, 1.0), ((10.0, 5.0), (1.0, 1.0)), (5.0, 1.0)],
    # A wall comes near, and a plain opens.
    [(10.0, 1.0), (10.0, 8.0), (10.0, 0.1), (10.0, 1.0)],
    # It reverses.
    [(10.0, 1.0), ((10.0, 0.0), (1.0, 0.0)), (-2.0, -1.0)],
    # It starts fast.
    [(1.0, 1.0), (10.0, 1.0)]])
@pytest.mark.parametrize('rate', [5.0, 30.0])
def test_what_a_vehicle_does_is_not_doubted(rate, plan):
    drive = Drive(rate)
    for road, passing in plan:
        drive.go(6, road=road, passing=passing)
    assert drive.doubted == []


def test_a_new_scene_is_the_usual_one_after_a_while():
    drive = Drive().go(10, road=10.0, passing=1.0).go(60, road=1.2, passing=1.0)
    assert drive.doubted[-1] == pytest.approx(19.5, abs=1.0)
    drive.go(5, road=10.0, passing=1.0).go(20, road=10.0, passing=1.0)
    assert drive.go(5, road=1.2, passing=1.0).doubted[-1] == pytest.approx(100)


@pytest.mark.parametrize('state', [TravelState.STANDING, TravelState.GIVEN])
def test_what_was_long_ago_is_not_usual(state):
    drive = Drive().go(20, road=10.0, passing=1.0).go(9, road=0.0, passing=0.0, state=state)
    assert drive.go(10, road=1.2, passing=1.0).doubted == []
    drive = Drive().go(20, road=10.0, passing=1.0).go(3, road=0.0, passing=0.0, state=state)
    assert drive.go(10, road=1.2, passing=1.0).doubted


def test_only_measured_pairs_are_usual_ones():
    bridged = Drive().go(10, road=10.0, passing=1.0, state=TravelState.BRIDGED)
    assert bridged.go(5, road=1.2, passing=1.0).doubted == []
    brief = Drive().go(1.5, road=10.0, passing=1.0).go(10, road=1.2, passing=1.0)
    assert brief.doubted == []
    for state in (TravelState.GIVEN, TravelState.STANDING, TravelState.UNKNOWN):
        other = Drive().go(10, road=10.0, passing=1.0).go(5, road=1.2, passing=1.0, state=state)
        assert other.doubted == []


def test_the_limits():
    for road, doubted in ((10 / 4.5, False), (10 / 6.5, True)):
        drive = Drive().go(40, road=10.0, passing=1.0).go(9, road=road, passing=1.0)
        assert bool(drive.doubted) is doubted
    # Nearer by far, but hardly slower.
    for road, doubted in ((5.5, False), (2.5, True)):
        drive = Drive().go(40, road=10.0, passing=1.0).go(6, road=road, passing=5.0)
        assert bool(drive.doubted) is doubted
