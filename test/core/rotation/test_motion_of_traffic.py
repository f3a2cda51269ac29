# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A turn of traffic differs from one of the vehicle: nothing passes by, and a part rests."""

from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.cross_traffic import CrossTraffic
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
import pytest

LORRY = (0.03, 0.001, 0.4)
COVERING = (0.03, 0.001, 0.02)
SCATTERED = (0.03, 0.02, 0.4)
TURN = (-0.03, 0.03, 0.0)
STRAIGHT = (0.0, 0.03, 0.1)
COVERING_AT_REST = (0.0, 0.002, 0.3)
FREE = (0.0, 0.0, 0.9)


def after(*motions):
    """Return whether the last of these motions (yaw, passing, resting) may be of traffic."""
    traffic = CrossTraffic()
    for yaw, passing, resting in motions:
        motion = CameraMotion(
            yaw, 0.0, 0.0, FocusOfExpansion(), 50.0, 0.8, 1e-6, passing)
        traffic.update(motion, resting, 0.1)
    return traffic.may_cross


@pytest.mark.parametrize(('motions', 'may_cross'), [
    ([TURN], False), ([STRAIGHT], False), ([FREE], False),
    # On the spot: all of the image turns.
    ([COVERING], False),
    # A bonnet rests in a turn, but the scene passes by.
    ([SCATTERED], False),
    ([LORRY], True), ([LORRY, COVERING, COVERING], True), ([LORRY, SCATTERED], True),
    ([LORRY, COVERING_AT_REST, COVERING], True),
    # A single contradiction may be wrong.
    ([LORRY, TURN], True), ([LORRY, TURN, TURN], False), ([LORRY, TURN, COVERING, TURN], True),
    ([LORRY, STRAIGHT, STRAIGHT], False),
    # It has passed.
    ([LORRY, FREE, COVERING], False), ([LORRY, TURN, TURN, COVERING], False)])
def test_traffic_begins_with_a_part_at_rest_and_ends_with_a_vehicle_that_drives(
        motions, may_cross):
    assert after(*motions) is may_cross
    mirrored = [(-yaw, passing, resting) for yaw, passing, resting in motions]
    assert after(*mirrored) is may_cross


def test_a_slow_turn_is_that_of_noise():
    assert not after((0.004, 0.0, 0.4))
    assert after((0.006, 0.0, 0.4))
