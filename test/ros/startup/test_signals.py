# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Signals set an event, however many arrive."""

import signal

from phase_traj_ros.cli.ending import handle_signals, raise_ended
from phase_traj_ros.ros.startup.signals import stop_on_signals
import pytest

NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def handlers():
    """Restore the handlers, which ignore signals once one has arrived."""
    before = {number: signal.getsignal(number) for number in NUMBERS}
    yield before
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('number', NUMBERS)
def test_a_signal_while_the_event_is_set_is_ignored(number):
    with stop_on_signals() as stop:
        finish, begun = stop.set, []

        def interrupted():
            begun.append(number)
            for each in NUMBERS:
                signal.raise_signal(each)
            finish()

        stop.set = interrupted
        signal.raise_signal(number)
        assert stop.is_set()
        assert begun == [number]
    assert all(signal.getsignal(each) is signal.SIG_IGN for each in NUMBERS)


def test_two_signals_at_the_same_moment_report_nothing(monkeypatch):
    errors = []
    monkeypatch.setattr('sys.unraisablehook', errors.append)
    with stop_on_signals() as stop:
        signal.pthread_sigmask(signal.SIG_BLOCK, NUMBERS)
        for number in NUMBERS:
            signal.raise_signal(number)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, NUMBERS)
        assert stop.is_set()
    assert errors == []


def test_a_program_that_a_signal_has_ended_ignores_further_ones():
    handle_signals(raise_ended)
    with stop_on_signals() as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop.is_set()
    assert all(signal.getsignal(each) is signal.SIG_IGN for each in NUMBERS)


def test_without_a_signal_the_handlers_are_those_of_before(handlers):
    with stop_on_signals() as stop:
        assert not stop.is_set()
    assert {number: signal.getsignal(number) for number in NUMBERS} == handlers


def test_after_nohup_the_end_of_the_terminal_stays_ignored():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with stop_on_signals() as stop:
        signal.raise_signal(signal.SIGHUP)
        assert not stop.is_set()
