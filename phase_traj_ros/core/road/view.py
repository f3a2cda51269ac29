# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The patches of the road that a camera sees, and the tilt for which they are made."""

from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.road.ground import GroundPatch, stretches
from phase_traj_ros.core.road.patch_matcher import PatchMatcher
from phase_traj_ros.core.road.tuning import TUNING


class RoadView:
    """Projects frames to the near and the far patch of the road, with that of the keyframe."""

    def __init__(
        self, camera: CameraModel, horizon: Horizon, *, mask: NDArray[np.float32] | None,
    ) -> None:
        """Prepare a view without patches; the arguments are those of ``RoadMeter``."""
        self._camera, self._horizon = camera, horizon
        self._mask = mask
        self._matchers: tuple[PatchMatcher, ...] | None = None
        self.pitch = self._azimuth = 0.0
        """Pitch of the camera for which the patches are made, in radians, positive down."""
        self.key_frame: Frame | None = None
        """Frame with which the next ones are compared; None if there is none."""
        self._key_roll = 0.0
        # The newest frames on which the road had moved: new patches learn from them, too.
        self._moved: deque[Frame] = deque(maxlen=TUNING.relearned_patches)

    @property
    def patches(self) -> tuple[PatchMatcher, ...]:
        """Return the patches in view, the near one first; none before ``follow``."""
        return self._matchers or ()

    @property
    def is_empty(self) -> bool:
        """Return whether too little of the road is in view."""
        return self._matchers == ()

    def use_mask(self, mask: NDArray[np.float32] | None) -> None:
        """Make the patches again if this is another mask."""
        if mask is not self._mask:
            self._mask, self._matchers = mask, None

    def discard(self) -> None:
        """Discard the patches: the tilt is too uncertain."""
        self._matchers = None

    def follow(self, pitch: float, azimuth: float, *, may_change: bool) -> None:
        """
        Make the patches for a vehicle that drives straight ahead at this ``azimuth``.

        Patches for about this tilt, and all unless they ``may_change``, are kept.
        """
        is_near = (abs(pitch - self.pitch) <= TUNING.max_pitch_error
                   and abs(azimuth - self._azimuth) <= TUNING.max_azimuth_error)
        if self._matchers is not None and (is_near or not may_change):
            return
        self.pitch, self._azimuth = pitch, azimuth
        levelling = replace(self._horizon, pitch=pitch).levelling(azimuth)
        seen = stretches(self._camera, levelling)
        patches = [
            GroundPatch(self._camera, levelling, stretch, mask=self._mask) for stretch in seen]
        # One for both: the difference of their depths gives the pitch.
        least = TUNING.least_offset * (seen[0][1] - seen[0][0]) if seen else 0.0
        self._matchers = tuple(
            PatchMatcher(patch, least_offset=least)
            for patch in patches if patch.share > TUNING.min_seen)
        if len(self._moved) == self._moved.maxlen:
            for frame in self._moved:
                for patch in self._matchers:
                    patch.add(frame)
                    patch.learn()
        if self.key_frame is not None:
            self.restart(self.key_frame, self._key_roll)

    def restart(self, frame: Frame, roll: float) -> None:
        """Make the first frame of a pair, (H, W), the keyframe; see ``lean`` for its roll."""
        self.key_frame, self._key_roll = frame, roll
        for patch in self.patches:
            patch.restart(frame, self.lean(roll))

    def renew(self, frame: Frame, roll: float, *, learns: bool) -> None:
        """Make the newest projected frame the keyframe; the patches may learn from it."""
        self.key_frame, self._key_roll = frame, roll
        if learns:
            self._moved.append(frame)
        for patch in self.patches:
            if learns:
                patch.learn()
            patch.set_reference(self.lean(roll))

    def lean(self, roll: float) -> float:
        """Return a roll relative to that of the patches; 0 if it makes no difference."""
        lean = roll - self._horizon.roll
        return lean if abs(lean) > TUNING.min_lean else 0.0
