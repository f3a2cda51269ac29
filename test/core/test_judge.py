# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A pair of frames gets its status and its worth from what was measured, and in one place."""

from phase_traj_ros.core import PairStatus, Shift
from phase_traj_ros.core.correlation.quality import Worth
from phase_traj_ros.core.judge import judged
from phase_traj_ros.core.measuring import Comparison
from phase_traj_ros.core.reliability import Evidence
import pytest

SHIFT = Shift(1.0, 0.0, 0.2)
GOOD = Comparison(SHIFT, None, Worth.MEASURED, SHIFT, agreement=0.8)
SCATTERED = Comparison(SHIFT, None, Worth.MEASURED, SHIFT, agreement=0.2)
STILL = Comparison(SHIFT, None, Worth.STILL, SHIFT, agreement=0.8)
NOTHING = Comparison(SHIFT, None, Worth.NOTHING, SHIFT, agreement=0.8)


@pytest.mark.parametrize(('pair', 'known', 'status', 'evidence'), [
    (GOOD, {}, PairStatus.OK, Evidence.TRUSTED),
    (SCATTERED, {}, PairStatus.OK, Evidence.SCATTERED),
    (STILL, {}, PairStatus.STILL, Evidence.STILL),
    (NOTHING, {}, PairStatus.NO_MEASUREMENT, Evidence.BLANK),
    (Comparison(), {}, PairStatus.REPRIMED, Evidence.APART),
    (Comparison(gap=True), {}, PairStatus.GAP, Evidence.APART),
    (GOOD, {'repeated': True}, PairStatus.REPEATED, Evidence.REPEATED),
    (GOOD, {'blank': True}, PairStatus.OK, Evidence.BLANK),
    (GOOD, {'implausible': True}, PairStatus.NO_MEASUREMENT, Evidence.JERKED),
    (GOOD, {'implausible': True, 'fixed': True}, PairStatus.NO_MEASUREMENT, Evidence.FIXED),
    (SCATTERED, {'implausible': True}, PairStatus.NO_MEASUREMENT, Evidence.SCATTERED),
    # A vehicle that stands does not turn, and shows nothing but noise at night.
    (STILL, {'implausible': True, 'blank': True}, PairStatus.STILL, Evidence.STILL)])
def test_a_pair_is_judged_by_the_first_thing_that_speaks_against_it(
        pair, known, status, evidence):
    assert judged(pair, **known) == (status, evidence)


def test_the_rule_of_the_paper_codes_a_shift_whatever_the_yaw():
    assert judged(GOOD, implausible=True, by_yaw=False) == (PairStatus.OK, Evidence.JERKED)
