# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Drives of many cameras that are not known beforehand, and their ground truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from benchmarks.heading.drives import bonnet, Frame
from benchmarks.shared.clips import at_axle
import numpy as np
from phase_traj_ros.core.heading.turns import Turn as FoundTurn
from phase_traj_ros.synthetic import (
    Camera,
    Drive,
    KITTI_CAMERA,
    plan_drive,
    render_drive,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.camera import EQUIDISTANT, EQUISOLID, STEREOGRAPHIC

_SPEED = 8.0
#: Turns of these sizes, in degrees, count neither way: a little more or less is another number of
#: right angles.
BETWEEN = ((55.0, 65.0), (130.0, 140.0))


@dataclass(frozen=True)
class Mount:
    """A camera, its frame rate, and its pose on the vehicle."""

    camera: Camera
    rate_hz: float
    pitch_deg: float = 0.0
    """Positive nose down."""
    roll_deg: float = 0.0
    """Positive right side down."""
    yaw_deg: float = 0.0
    """Positive to the left."""
    ahead: float = 0.0
    """Metres ahead of the rear axle, the point that moves where the vehicle heads."""
    overlay: Callable[[Frame], Frame] | None = None


def _bars_and_bonnet(frame: Frame) -> Frame:
    """Blacken an eighth at each side, and draw a bonnet in the lower fifth."""
    bar = frame.shape[1] // 8
    frame = bonnet(frame)
    frame[:, :bar] = frame[:, -bar:] = 0
    return frame


_wide = Camera.with_field_of_view
MOUNTS = {
    '320×240, 62°, 20 Hz': Mount(_wide(320, 240, 62), 20.0, ahead=1.5),
    '320×240, 90°, 20 Hz': Mount(_wide(320, 240, 90), 20.0),
    '640×480, 70°, 10 Hz': Mount(_wide(640, 480, 70), 10.0, pitch_deg=3.0, roll_deg=-2.0),
    '640×480, 50°, 15 Hz': Mount(_wide(640, 480, 50), 15.0, ahead=1.5),
    '640×400, 110°, 15 Hz': Mount(_wide(640, 400, 110), 15.0, pitch_deg=-4.0, ahead=1.5),
    '640×360, 130°, 30 Hz': Mount(_wide(640, 360, 130), 30.0, ahead=1.5),
    '1241×376, 82°, 10 Hz': Mount(KITTI_CAMERA, 10.0, ahead=1.0),
    '1280×720, 45°, 10 Hz': Mount(_wide(1280, 720, 45), 10.0, pitch_deg=2.0, ahead=1.5),
    '1920×1080, 80°, 30 Hz': Mount(_wide(1920, 1080, 80), 30.0, roll_deg=1.5, ahead=1.5),
    '640×480, 75°, 15 Hz, tilted by 15°': Mount(
        _wide(640, 480, 75), 15.0, pitch_deg=15.0, ahead=1.5),
    '640×360, 85°, 15 Hz, bars and bonnet': Mount(
        _wide(640, 360, 85), 15.0, pitch_deg=2.0, ahead=1.5, overlay=_bars_and_bonnet),
    '640×480, fisheye of 130°, 15 Hz': Mount(
        _wide(640, 480, 130, fisheye=EQUIDISTANT), 15.0, pitch_deg=5.0, ahead=1.5),
    '320×240, fisheye of 120°, 20 Hz': Mount(
        _wide(320, 240, 120, fisheye=EQUISOLID), 20.0, ahead=0.3),
    '640×480, fisheye of 110°, 10 Hz': Mount(
        _wide(640, 480, 110, fisheye=STEREOGRAPHIC), 10.0, roll_deg=3.0, ahead=1.5),
    '160×120, fisheye of 150°, 20 Hz': Mount(
        _wide(160, 120, 150, fisheye=EQUIDISTANT), 20.0, pitch_deg=5.0, ahead=0.3),
    '480×270, 75°, 15 Hz, turned by 6°': Mount(
        _wide(480, 270, 75), 15.0, pitch_deg=2.0, yaw_deg=6.0, ahead=1.5),
}

_LAP = Turn(360, 14, 5)
#: Into a roundabout, and out of it.
_ENTRY = Turn(-45, 1.8, 5)
PLANS = {
    'right angles': [
        Straight(2), Turn(90, 3, 4.5), Straight(3), Turn(-90, 3, 4.5), Straight(2.5),
        Turn(90, 3.5, 4.5), Straight(2), Turn(90, 2.5, 4), Straight(2)],
    'U-turns': [Straight(3), Turn(180, 6, 4), Straight(3), Turn(-180, 5, 4), Straight(3)],
    'roundabout': [
        Straight(3), _ENTRY, Turn(180, 6.5, 5), _ENTRY, Straight(4),
        _ENTRY, Turn(90, 3.5, 5), _ENTRY, Straight(3),
        _ENTRY, Turn(270, 9.5, 5), _ENTRY, Straight(2)],
    'gentle bends': [
        Straight(2), Turn(90, 12), Straight(2), Turn(-45, 7), Straight(2), Turn(-85, 10),
        Straight(2)],
    'S-bends': [
        Straight(3), Turn(35, 2.5, 6), Turn(-35, 2.5, 6), Straight(3), Turn(-42, 3, 6),
        Turn(42, 3, 6), Straight(3), Turn(30, 3), Straight(2), Turn(-30, 3), Straight(2)],
    'oblique crossings': [
        Straight(2.5), Turn(75, 3, 4.5), Straight(3), Turn(-110, 3.5, 4.5), Straight(3),
        Turn(75, 2.5, 4.5), Straight(2.5), Turn(-110, 4, 4.5), Straight(2)],
    'full circles': [Straight(2), _LAP, _LAP, Straight(2)],
    'standing still': [Straight(15, 0.0)],
    'walking pace': [
        Straight(4, 1.3), Turn(90, 4, 1.3), Straight(4, 1.3), Turn(-90, 6, 1.3), Straight(4, 1.3)],
    'slow corners': [
        Straight(3, 1.0), Turn(90, 24, 1.0), Straight(5, 1.0), Turn(-90, 24, 1.0),
        Straight(5, 1.0)],
}


def right_order(turns: Iterable[FoundTurn], *, frames: int) -> str:
    """
    Return the right codes of turns of at least 55 degrees, as a regular expression.

    These are L or R for each quarter turn, in the order of time. For a turn near the limit between
    two numbers of quarters, either number is right, for an unfinished turn at the end any.
    """
    expression = ''
    for turn in turns:
        side, quarters = 'L' if turn.angle_deg > 0 else 'R', abs(turn.quarter_turns)
        if turn.end_frame >= frames - 1:
            expression += f'{side}{{0,{quarters + 1}}}'
        elif any(low <= abs(turn.angle_deg) <= high for (low, high) in BETWEEN):
            # 60 and 135 degrees are where one and two begin.
            fewer = 0 if abs(turn.angle_deg) < 90 else 1
            expression += f'{side}{{{fewer},{fewer + 1}}}'
        else:
            expression += side * quarters
    return expression


def ride(plan: str, mount: str) -> tuple[Drive, Iterator[Frame]]:
    """Return the drive of one of the plans with one of the cameras, and what it sees."""
    sits = MOUNTS[mount]
    drive = plan_drive(
        f'{plan}, {mount}', PLANS[plan], rate_hz=sits.rate_hz, speed=_SPEED, camera=sits.camera,
        seed=23)
    poses = at_axle(drive.poses, -sits.ahead)
    poses[:, 2] += np.radians(sits.yaw_deg)
    poses[:, 3:] = np.radians((sits.pitch_deg, sits.roll_deg))
    drive = replace(drive, poses=poses)
    frames = render_drive(drive)
    return drive, frames if sits.overlay is None else map(sits.overlay, frames)
