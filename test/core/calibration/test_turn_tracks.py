# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a part of a turn begins and ends."""

import numpy as np
from phase_traj_ros.core.calibration.turn_tracks import TurnTracker
import pytest
import textures


@pytest.mark.parametrize('pause', [2, 8, 12])
def test_a_turn_to_the_other_side_is_another_one(pause):
    first, _ = textures.pair((160, 320), 0, 0)
    shifts = [0, *[12] * 14, *[0] * pause, *[-12] * 14, *[0] * 12]
    tracker, places = TurnTracker(), np.cumsum(shifts)
    ended = [
        tracker.update(np.roll(first, place, axis=1), float(shift), 0.1)
        for place, shift in zip(places, shifts)]
    to_the_right, to_the_left = (tracks.flow for tracks in ended if tracks is not None)
    for flow in (to_the_right, -to_the_left):
        assert flow[-1] == pytest.approx(14 * 12, abs=24)
        assert (np.diff(flow) > 0.0).all()


def test_pictures_of_a_few_rows_have_no_points():
    first, _ = textures.pair((10, 320), 0, 0)
    tracker = TurnTracker()
    shifts = [0, *[12] * 14, *[0] * 12]
    assert not any(
        tracker.update(np.roll(first, place, axis=1), float(shift), 0.1)
        for place, shift in zip(np.cumsum(shifts), shifts))
