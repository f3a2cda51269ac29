# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The mount of a camera on the vehicle, and what it adds to the parameters."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
import math

import numpy as np
from phase_traj_ros.core import Update
from phase_traj_ros.core.camera.lens import MAX_TILT_DEG
from phase_traj_ros.core.path.odometry import covariance_rows, Odometry
from phase_traj_ros.core.path.trajectory import Corner
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.parameters import Parameters, specs

# Less is the rounding of a chain of frames, or a vehicle frame at the camera.
_LEAST_HEIGHT_M = 0.01
# Cameras are not mounted farther away.
_FARTHEST_M = 100.0
# Metres and degrees by which the same mount may differ.
_ROUNDING = 1e-5
_LEVER = 'the lever arm of odom'
# On rendered drives of 190 m, the heading drifts by 1 degree with 10 degrees, by 2 to 3 with 15,
# and by 3 to 6 with 20. The distance does not depend on it.
_MOST_ASIDE_DEG = 15.0


@dataclass(frozen=True, slots=True)
class Mount:
    """Place and angles of a camera on the vehicle, in the axes of the vehicle (REP 103)."""

    base_frame: str
    camera_frame: str
    x: float
    """Metres ahead of the origin of the vehicle."""
    y: float
    """Metres to the left of it."""
    height: float
    """Metres above the ground: the origin of ``ground_frame``."""
    pitch_deg: float
    """Positive down."""
    roll_deg: float
    """Positive right side down; 180 for a camera that is mounted upside down."""
    yaw_deg: float
    """Positive to the left."""
    ground_frame: str
    """``base_footprint`` if it is known, else ``base_frame``."""

    def __str__(self) -> str:
        """Return a description."""
        # Zeros have no sign.
        x, y = (round(place, 2) + 0.0 for place in (self.x, self.y))
        pitch, roll, yaw = (
            round(angle, 1) + 0.0 for angle in (self.pitch_deg, self.roll_deg, self.yaw_deg))
        return (
            f'{self.camera_frame} is {self.height:.2f} m above {self.ground_frame}, {x:.2f} m'
            f' ahead and {y:.2f} m left of {self.base_frame}, pitch {pitch:.1f} deg down,'
            f' roll {roll:.1f} deg, yaw {yaw:.1f} deg')

    def fill_in(self, given: Parameters) -> 'Mounting':
        """
        Return ``given`` with the values that it leaves out and that have an effect.

        Angles and positions that are impossible for a camera on a vehicle are left out.

        Raises
        ------
        ParameterError
            The values are not consistent with ``given``.

        """
        used = dict(self._found(given))
        settings = given.with_values(used).settings
        if settings.metric and not settings.speed_given and abs(self.y) <= _FARTHEST_M:
            used[_LEVER] = self.y
        return Mounting(given, self, used, tuple(self._doubts(given)))

    def _found(self, given: Parameters) -> Iterator[tuple[str, float]]:
        """
        Yield name and value of what ``fill_in`` adds to ``given``.

        The paper's rule needs none: a height would require a lens. At a constant speed, the height
        has no effect.
        """
        if not given.settings.needs_lens:
            return
        if (given.camera_height == given.speed == 0.0
                and _LEAST_HEIGHT_M <= self.height <= _FARTHEST_M):
            yield 'camera_height', self.height
        roll = self.roll_deg
        if given.rotate_180:
            roll = math.remainder(roll + 180.0, 360.0)
        if max(abs(self.pitch_deg), abs(roll)) <= MAX_TILT_DEG:
            if given.camera_pitch_deg == 0.0:
                yield 'camera_pitch_deg', self.pitch_deg
            if given.camera_roll_deg == 0.0:
                yield 'camera_roll_deg', roll

    def _doubts(self, given: Parameters) -> Iterator[str]:
        if abs(self.roll_deg) > 90.0 and not given.rotate_180:
            yield (f'/tf_static: {self.camera_frame} is mounted upside down: set rotate_180,'
                   ' unless the driver turns the images')
        aside = abs(self.yaw_deg)
        if not given.settings.measures_heading:
            return
        if aside >= 180.0 - _MOST_ASIDE_DEG:
            yield (f'/tf_static: {self.camera_frame} looks to the rear: headings are right, but'
                   ' distances are negative')
        elif aside > _MOST_ASIDE_DEG:
            side = 'left' if self.yaw_deg > 0.0 else 'right'
            yield (f'/tf_static: {self.camera_frame} looks {aside:.0f} degrees to the'
                   f' {side}: headings are right up to about {_MOST_ASIDE_DEG:g} degrees')


@dataclass(frozen=True, slots=True)
class Mounting:
    """
    Parameters as given, and what the mount of the camera adds to them.

    Raises
    ------
    ParameterError
        The values from the mount are not consistent with the given ones.

    """

    given: Parameters
    mount: Mount | None = None
    """The newest usable one; None if it is unknown."""
    used: Mapping[str, float] = field(default_factory=dict)
    """What is used of a mount: values by the names of the parameters, and the lever arm."""
    doubts: tuple[str, ...] = ()
    """What is doubtful about the mount, in sentences without capital and full stop."""
    parameters: Parameters = field(init=False, repr=False, compare=False)
    """The given ones with the values from the mount."""

    def __post_init__(self) -> None:
        object.__setattr__(self, 'parameters', self.given.with_values(self.found))

    @property
    def found(self) -> Mapping[str, float]:
        """Return the values from a mount, by the names of the parameters."""
        return {name: value for name, value in self.used.items() if name != _LEVER}

    def __str__(self) -> str:
        """Return a sentence on the mount and what is used of it; empty if nothing is."""
        if not self.used:
            return ''
        return f'/tf_static: {self.mount}; from there: {", ".join(self.used)}'

    def with_given(self, given: Parameters) -> 'Mounting':
        """
        Return other parameters with the same values from the mount.

        Raises
        ------
        ParameterError
            The values are not consistent with ``given``, or the mount adds others to it.

        """
        other = replace(self, given=given)
        if self.mount is None:
            return other
        followed = other.with_mount(self.mount)
        if not followed.acts_as(other):
            names = ' or '.join(
                spec.name for spec in specs() if given.value(spec) != self.given.value(spec))
            raise ParameterError(
                f'{names} would change what is taken from /tf_static: set it at the start')
        return followed

    def with_mount(self, mount: Mount) -> 'Mounting':
        """
        Return the same parameters with another mount.

        What is used stays if nothing changes by the other mount, and where the paper's rule,
        which takes nothing, has followed: the camera that the turns have found still needs it.

        Raises
        ------
        ParameterError
            The values are not consistent with the given ones.

        """
        other = mount.fill_in(self.given)
        if self.used and (other.acts_as(self) or not self.given.settings.needs_lens):
            return replace(self, mount=mount, doubts=other.doubts)
        return other

    def acts_as(self, other: 'Mounting') -> bool:
        """Return whether the same values are used, up to the rounding of a chain of frames."""
        return self.used.keys() == other.used.keys() and all(
            math.isclose(value, other.used[name], rel_tol=0.0, abs_tol=_ROUNDING)
            for name, value in self.used.items())

    def at_base(self, update: Update) -> Update:
        """
        Return ``update`` with the odometry of the vehicle's origin instead of the camera's.

        The pose moves along the heading, as the point of the vehicle does that never slips
        sideways, such as the middle of the rear axle. The origin is taken to be there: a camera
        ahead of it changes nothing, and one to the left of it drives a shorter arc to the left.
        A speed that the parameters give is that of the origin, so nothing is corrected.
        """
        left = self.used.get(_LEVER)
        if update.odometry is None or left is None:
            return update
        return replace(update, odometry=_at_origin(update.odometry, left))


def _at_origin(odometry: Odometry, left: float) -> Odometry:
    pose, covariance = odometry.pose, np.array(odometry.covariance)
    along, across = left * math.sin(pose.yaw), left * (1.0 - math.cos(pose.yaw))
    change = np.array([[1.0, 0.0, left - across], [0.0, 1.0, along], [0.0, 0.0, 1.0]])
    return replace(
        odometry,
        pose=Corner(pose.x + along, pose.y + across, pose.yaw, pose.stamp_ns),
        speed=odometry.speed + odometry.yaw_rate * left,
        speed_variance=odometry.speed_variance + left * left * odometry.yaw_rate_variance,
        covariance=covariance_rows(change @ covariance @ change.T))
