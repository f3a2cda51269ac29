# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from phase_traj_ros.core.frames.jitter import StampJitter
import pytest

_INTERVAL_NS = 33_000_000


def _deviations(stamps_ns) -> list[float]:
    jitter, found = StampJitter(), []
    for interval_ns in np.diff(stamps_ns).astype(int).tolist():
        found.append(jitter.deviation_ns(interval_ns))
        jitter.add(interval_ns)
    return found


def test_the_first_frames_may_be_late():
    found = _deviations(_INTERVAL_NS * np.arange(6))
    assert found == pytest.approx([_INTERVAL_NS / 3] * 3 + [0.0, 0.0])


@pytest.mark.parametrize('share', [0.02, 0.1, 0.25])
def test_intervals_are_off_by_the_errors_of_two_stamps(share):
    off = np.random.default_rng(1).normal(0.0, share * _INTERVAL_NS, 400)
    found = _deviations(_INTERVAL_NS * np.arange(400) + off)
    assert np.median(found[20:]) == pytest.approx(np.sqrt(2.0) * share * _INTERVAL_NS, rel=0.15)


@pytest.mark.parametrize('late', [0.1, 0.2, 1 / 3, 0.5, 0.6, 2 / 3, 0.8, 0.9])
def test_every_other_stamp_may_be_late(late):
    stamps_ns = _INTERVAL_NS * (np.arange(40) + np.tile([late, 0.0], 20))
    assert _deviations(stamps_ns)[5:] == pytest.approx([late * _INTERVAL_NS] * 34, rel=0.01)


def test_of_the_first_frames_several_may_be_late():
    found = _deviations(_INTERVAL_NS * np.array([0.0, 1.8, 2.1, 3.0]))
    assert found == pytest.approx([0.6 * _INTERVAL_NS] * 3)


def test_a_longer_interval_spans_lost_frames_or_its_frame_is_late():
    numbers = np.flatnonzero(np.isin(np.arange(60) % 20, [7, 14, 15], invert=True))
    found = np.array(_deviations(_INTERVAL_NS * numbers))[3:]
    # All periods but one are three deviations.
    assert found * 3.0 == pytest.approx(_INTERVAL_NS * (np.diff(numbers)[3:] - 1.0))


def test_after_another_rate_the_old_one_is_forgotten():
    stamps_ns = np.cumsum([_INTERVAL_NS] * 30 + [3 * _INTERVAL_NS] * 30)
    found = _deviations(stamps_ns)
    assert max(found[5:29]) == max(found[45:]) == 0.0


@pytest.mark.parametrize(('periods', 'off'), [
    (1.0, 0.0), (0.1, 0.9), (0.6, 0.4), (1.3, 0.3), (1.8, 0.8 / 3), (3.0, 2 / 3)])
def test_an_interval_is_off_by_what_is_no_whole_period(periods, off):
    jitter = StampJitter()
    for _ in range(10):
        jitter.add(_INTERVAL_NS)
    found = jitter.deviation_ns(round(periods * _INTERVAL_NS))
    assert found == pytest.approx(off * _INTERVAL_NS, abs=1.0)
