# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The named drives of the package."""

from collections.abc import Callable
from functools import partial

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic.camera import Camera
from phase_traj_ros.synthetic.drive.drive import Drive, plan_drive
from phase_traj_ros.synthetic.drive.plan import Plan, Straight, Turn

#: Speed on straights and in turns, in metres per second.
_SPEED = 8.0
_TURNING = 4.5


def _turn(angle_deg: float) -> Turn:
    return Turn(angle_deg, 3.0, _TURNING)


def town_drive() -> Drive:
    """Return 538 small frames through streets at odd angles, as on few places of a map."""
    def turn(angle_deg: float, speed: float = 5.5) -> Turn:
        return Turn(angle_deg, max(abs(angle_deg) / 36.0, 0.8), speed)

    return plan_drive('town', [
        Straight(4.0), turn(80), Straight(5.0), turn(-95), Straight(3.2), turn(30, 8.0),
        Straight(4.4), turn(100), Straight(6.0), turn(70), Straight(3.0), turn(-35, 8.0),
        Straight(3.5), turn(-90), Straight(5.0), turn(-65), Straight(4.0)], speed=9.0, seed=4,
        camera=Camera.with_field_of_view(620, 188, 82.0))


_PLANS: dict[str, Plan] = {
    # 201 frames: left, right, left.
    'demo': [
        Straight(3.0), _turn(90), Straight(3.2), _turn(-90), Straight(2.6), _turn(90),
        Straight(2.2)],
    # The paper's first case study: 241 frames, right, right.
    'paper_case_1': [Straight(2.3), _turn(-90), Straight(4.9), _turn(-90), Straight(10.8)],
    # The paper's second case study: 200 frames, left, right, right.
    'paper_case_2': [
        Straight(2.2), _turn(90), Straight(4.2), _turn(-90), Straight(2.5), _turn(-90),
        Straight(2.0)],
}
#: Functions that make the drives, by name.
DRIVES: dict[str, Callable[[], Drive]] = {
    name: partial(plan_drive, name, plan, speed=_SPEED, seed=seed)
    for (seed, (name, plan)) in enumerate(_PLANS.items(), 1)}


def named_drive(name: str) -> Drive:
    """Return the drive with this name; raises `ParameterError` if the name is unknown."""
    if name not in DRIVES:
        raise ParameterError(f'there is no drive {name!r}: choose one of {", ".join(DRIVES)}')
    return DRIVES[name]()
