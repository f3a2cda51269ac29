# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""When the texts of the codes and the path go out."""

from types import SimpleNamespace

from phase_traj_ros.core import Direction, Movement
from phase_traj_ros.io.messages.schedule import Pace, Schedule
from phase_traj_ros.io.messages.topics import CHAIN_CODE, LINKS, PATH
from phase_traj_ros.parameters import Parameters

TENTH = 10**8


def made(**values):
    return Schedule(Parameters(**values))


def pair(movement, links=()):
    return SimpleNamespace(step=SimpleNamespace(movement=movement), links=links)


def sent(schedule, movements):
    """Return what is sent with each of the pairs, a tenth of a second apart."""
    taken = []
    for index, movement in enumerate(movements):
        schedule.add(pair(movement))
        taken.append(schedule.take(index * TENTH))
    return taken


def test_pace_sends_at_once_and_then_once_a_period():
    pace = Pace(100)
    assert not pace.is_due(0)
    pace.changed()
    assert pace.pending and pace.is_due(0)
    pace.sent(0)
    assert not pace.pending and not pace.is_due(500)
    pace.changed()
    assert pace.pending and not pace.is_due(99) and pace.is_due(100)


def test_urgent_content_does_not_wait():
    pace = Pace(100)
    pace.sent(0)
    pace.changed(urgent=True)
    assert pace.is_due(1)
    pace.sent(1)
    pace.changed()
    assert not pace.is_due(100) and pace.is_due(101)


def test_text_goes_out_when_the_movement_changes_else_once_a_second():
    movements = [Movement.FORWARD] * 15 + [Movement.LEFT] + [Movement.NO_CHANGE] * 14
    taken = sent(made(), movements)
    assert [index for index, topics in enumerate(taken) if CHAIN_CODE in topics] == [
        0, 10, 15, 16, 26]
    assert [index for index, topics in enumerate(taken) if PATH in topics] == [
        *range(0, 30, 2)]


def test_pending_content_is_sent_later_and_at_the_end():
    schedule = made()
    sent(schedule, [Movement.FORWARD] * 2)
    assert schedule.take(TENTH) == ()
    assert schedule.take(2 * TENTH) == (PATH,)
    assert schedule.take(6 * TENTH, rest=True) == (CHAIN_CODE,)
    assert schedule.take(7 * TENTH, rest=True) == () and schedule.take(10**12) == ()


def test_a_restart_is_sent_at_once():
    schedule = made()
    sent(schedule, [Movement.FORWARD] * 2)
    schedule.restart()
    assert schedule.take(2 * TENTH) == (CHAIN_CODE, PATH)
    schedule.add(pair(Movement.FORWARD))
    assert schedule.take(3 * TENTH) == (CHAIN_CODE,)


def test_links_go_out_when_their_direction_changes_else_once_a_second():
    schedule, taken = made(code_step=2.0), []
    for index in range(30):
        link = Direction.FORWARD if index < 14 else Direction.LEFT
        schedule.add(pair(Movement.FORWARD, (link,) if index % 2 == 0 else ()))
        taken.append(schedule.take(index * TENTH))
    assert [index for index, topics in enumerate(taken) if LINKS in topics] == [0, 10, 14, 24]


def test_without_a_step_there_are_no_links():
    schedule = made()
    schedule.add(pair(Movement.FORWARD, (Direction.FORWARD,)))
    assert LINKS not in schedule.take(0)
