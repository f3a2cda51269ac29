# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frames of a stream are used, by their stamps."""

import numpy as np
from phase_traj_ros.core.stamps import StampGate
import pytest

_EPOCH_S = 1_700_000_000.0


def _run(stamps_s: list[float]) -> tuple[list[float], list[int], tuple[int, int]]:
    """Return the stamps used, the places of restarts among them, and (repeated, dropped)."""
    gate: StampGate[float] = StampGate()
    passed = [
        each for stamp in stamps_s for each in gate.push(stamp, round(stamp * 1e9))]
    passed += gate.finish()
    return (
        [each.frame for each in passed],
        [number for number, each in enumerate(passed) if each.restarts],
        (gate.repeated, gate.dropped))


def _drive(start_s: float, *, frames: int = 10) -> list[float]:
    return [round(start_s + 0.1 * number, 3) for number in range(frames)]


def test_an_ordinary_stream_passes_unchanged() -> None:
    stamps = _drive(_EPOCH_S)
    assert _run(stamps) == (stamps, [], (0, 0))


def test_swapped_neighbours_cost_one_frame() -> None:
    stamps = _drive(5.0)
    stamps[4], stamps[5] = stamps[5], stamps[4]
    used, restarts, counts = _run(stamps)
    assert used == [*stamps[:5], *stamps[6:]]
    assert (restarts, counts) == ([], (0, 1))


def test_the_last_two_swapped_cost_one_frame() -> None:
    stamps = _drive(5.0)
    stamps[-2], stamps[-1] = stamps[-1], stamps[-2]
    used, restarts, counts = _run(stamps)
    assert used == stamps[:-1]
    assert (restarts, counts) == ([], (0, 1))


@pytest.mark.parametrize('rate_hz', [10, 30, 60, 120])
def test_a_clock_set_back_by_50_ms_costs_50_ms(rate_hz: int) -> None:
    before = [number / rate_hz for number in range(rate_hz)]
    after = [1.0 - 0.05 + number / rate_hz for number in range(rate_hz)]
    used, restarts, counts = _run(before + after)
    assert restarts == []
    assert sum(counts) <= 0.05 * rate_hz
    assert used == sorted(set(used))
    assert used[-1] == after[-1]


@pytest.mark.parametrize('bad_s', [0.0, _EPOCH_S + 3600.0, _EPOCH_S - 3600.0, _EPOCH_S + 5.0])
def test_a_stray_stamp_costs_its_frame_only(bad_s: float) -> None:
    good = _drive(_EPOCH_S)
    used, restarts, counts = _run([*good[:5], bad_s, *good[5:]])
    assert (used, restarts) == (good, [])
    assert counts == (0, 1)


def test_a_stray_stamp_after_a_gap_costs_its_frame_only() -> None:
    stamps = [*_drive(5.0), *_drive(65.0)]
    used, restarts, counts = _run([*stamps[:11], 150.0, *stamps[11:]])
    assert (used, restarts, counts) == (stamps, [], (0, 1))


def test_a_stray_stamp_at_the_end_is_used_only_if_it_is_ahead() -> None:
    good = _drive(_EPOCH_S)
    assert _run([*good, 0.0])[0] == good
    assert _run([*good, _EPOCH_S + 60.0])[0] == [*good, _EPOCH_S + 60.0]


@pytest.mark.parametrize('start_s', [0.0, _EPOCH_S])
def test_a_loop_restarts(start_s: float) -> None:
    once = _drive(start_s, frames=30)
    used, restarts, counts = _run(once * 3)
    assert used == once * 3
    assert restarts == [30, 60]
    assert counts == (0, 0)


def test_a_gap_stays_in_the_stream() -> None:
    stamps = [*_drive(5.0), *_drive(65.0), *_drive(70.0)]
    assert _run(stamps) == (stamps, [], (0, 0))


def test_a_first_stamp_of_zero_before_an_epoch_is_no_time() -> None:
    stamps = [0.0, *_drive(_EPOCH_S)]
    used, restarts, counts = _run(stamps)
    assert (used, restarts, counts) == (stamps, [1], (0, 0))


def test_repeated_stamps_are_dropped_also_while_a_frame_is_held() -> None:
    stamps = [*_drive(5.0), 65.0, 65.0, 65.1]
    used, restarts, counts = _run(stamps)
    assert used == [*_drive(5.0), 65.0, 65.1]
    assert (restarts, counts) == ([], (1, 0))


def test_a_slow_stream_is_held_once_at_most() -> None:
    gate: StampGate[int] = StampGate()
    passed = [len(list(gate.push(number, number * 3_000_000_000))) for number in range(5)]
    assert passed == [1, 0, 2, 1, 1]


def test_a_slow_stream_whose_intervals_differ_is_held_once_at_most() -> None:
    gate: StampGate[int] = StampGate()
    stamps = np.cumsum([0.0, *[3.0, 3.0, 1.2] * 5])
    passed = [
        len(list(gate.push(number, round(stamp * 1e9)))) for number, stamp in enumerate(stamps)]
    assert passed == [1, 0, 2, *[1] * 13]


def test_two_strays_in_a_row_are_both_dropped() -> None:
    good = _drive(_EPOCH_S)
    used, restarts, counts = _run([*good[:5], _EPOCH_S + 3600.0, 0.0, *good[5:]])
    assert (used, restarts) == (good, [])
    assert counts == (0, 2)
