# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A turn of traffic differs from one of the vehicle: nothing passes by, and a part rests."""

from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.cross_traffic import CrossTraffic
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
import pytest

ENTERS = (0.0, 0.0, 0.7)
LORRY = (0.03, 0.001, 0.4)
COVERING = (0.03, 0.001, 0.02)
SCATTERED = (0.03, 0.02, 0.4)
TURN = (-0.03, 0.03, 0.0)
STRAIGHT = (0.0, 0.03, 0.1)
COVERING_AT_REST = (0.0, 0.002, 0.3)
FREE = (0.0, 0.0, 0.9)


def add(traffic, values, *, moving=None, stood=True):
    """Add a motion (yaw, passing, resting)."""
    yaw, passing, resting = values
    traffic.update(
        CameraMotion(yaw, 0.0, 0.0, FocusOfExpansion(), 50.0, 0.8, 1e-6, passing), resting,
        moving=1.0 - resting if moving is None else moving, stood=stood)


def after(*motions):
    """Return whether the last of these motions (yaw, passing, resting) is of traffic."""
    traffic = CrossTraffic(still=0.001)
    for values in motions:
        add(traffic, values)
    return traffic.crosses


@pytest.mark.parametrize(('motions', 'crosses'), [
    ([TURN], False), ([STRAIGHT], False), ([FREE], False), ([ENTERS], False),
    # A camera that turns on the spot, and one that sees its own body at rest.
    ([FREE, COVERING], False), ([FREE, LORRY, LORRY], False),
    # What has entered before a turn of the vehicle says nothing after it.
    ([ENTERS, TURN, TURN, LORRY], False),
    # A bonnet rests in a turn, but the scene passes by.
    ([ENTERS, SCATTERED], False),
    ([ENTERS, LORRY], True), ([ENTERS, LORRY, COVERING, COVERING], True),
    ([ENTERS, LORRY, SCATTERED], True), ([ENTERS, LORRY, COVERING_AT_REST, COVERING], True),
    # A single contradiction may be wrong.
    ([ENTERS, LORRY, TURN], True), ([ENTERS, LORRY, TURN, TURN], False),
    ([ENTERS, LORRY, TURN, COVERING, TURN], True), ([ENTERS, LORRY, STRAIGHT], False),
    ([ENTERS, LORRY, STRAIGHT, COVERING], False),
    # It has passed.
    ([ENTERS, LORRY, FREE, COVERING], False), ([ENTERS, LORRY, FREE, LORRY], False),
    ([ENTERS, LORRY, TURN, TURN, COVERING], False)])
def test_traffic_enters_at_rest_and_ends_with_a_vehicle_that_drives(motions, crosses):
    assert after(*motions) is crosses
    mirrored = [(-yaw, passing, resting) for yaw, passing, resting in motions]
    assert after(*mirrored) is crosses


def test_nothing_enters_the_view_of_a_vehicle_that_drives():
    traffic = CrossTraffic(still=0.001)
    add(traffic, ENTERS, stood=False)
    add(traffic, LORRY)
    assert not traffic.crosses


def test_a_camera_that_begins_to_turn_slowly_is_not_what_enters():
    traffic = CrossTraffic(still=0.001)
    add(traffic, ENTERS, moving=0.0)
    add(traffic, LORRY)
    assert not traffic.crosses
