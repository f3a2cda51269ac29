# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Patches of the road, as seen from above.

The road is a plane, one unit (a height of the camera) below it. A place on it lies z ahead and x
to the right; the camera sees it in the direction (x, 1, z) of a level frame with x to the right,
y down and z ahead, which the horizon takes to the camera's own.
"""

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel, Sight
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.correlation.windows import Window, window_2d

CELL = 0.03
"""Side of a cell, in heights of the camera: 5 cm for one 1.65 m above the road."""

# Half the width, in heights: a lane and something of its neighbours.
_HALF_WIDTH = 2.1
# A patch ends where a row of the picture covers so many heights of the road, or at the last.
_COARSEST, _FARTHEST = 0.13, 10.0
# It begins no nearer than this, where cameras of a wide view see the vehicle's own shadow.
_NEAREST = 1.5
# The near patch ends and the far one begins at these shares of what is seen in between.
_NEAR_ENDS, _FAR_BEGINS = 0.55, 0.2
# What is seen has to be as long as this.
_SHORTEST = 1.0
# Cells over which the mean and the contrast of the asphalt are taken (standard deviations), and
# the contrast in grey levels below which there is nothing but the sensor's noise.
_MEAN, _CONTRAST, _NOISE = 8.0, 12.0, 2.0


@dataclass(frozen=True, slots=True)
class Stretch:
    """From where to where a patch reaches ahead, in heights of the camera."""

    begin: float
    end: float


def stretches(camera: CameraModel, horizon: Horizon) -> tuple[Stretch, ...]:
    """
    Return the near and the far stretch of the road that a camera shows well enough.

    There is none where it shows too little of the road.
    """
    ahead = np.arange(_NEAREST, _FARTHEST, CELL)
    sight = _seen(camera, horizon, np.zeros_like(ahead), ahead)
    rows = np.abs(np.diff(sight.rows))
    sharp = sight.seen[1:] & sight.seen[:-1] & (rows > CELL / _COARSEST)
    if not sharp.any():
        return ()
    first = int(sharp.argmax())
    after = np.flatnonzero(~sharp[first:])
    last = first + (int(after[0]) if after.size else len(sharp) - first)
    begin, length = float(ahead[first]), float(ahead[last] - ahead[first])
    if length < _SHORTEST:
        return ()
    return (
        Stretch(begin, begin + _NEAR_ENDS * length),
        Stretch(begin + _FAR_BEGINS * length, begin + length))


class GroundPatch:
    """
    Takes frames to a patch of the road, and patches to what they would be had the camera turned.

    Rows of a patch run from far to near, columns from left to right.
    """

    def __init__(
        self, camera: CameraModel, horizon: Horizon, stretch: Stretch, *,
        rotate_180: bool = False, mask: NDArray[np.float32] | None = None,
    ) -> None:
        """
        Compute the way from a frame to the patch.

        Parameters
        ----------
        camera
            The model of the upright picture.
        horizon
            How it is tilted against the road.
        stretch
            Where the patch is.
        rotate_180
            Whether the frames come upside down.
        mask
            (H, W) from 0 to 1, how much each pixel of the frames counts.

        """
        count = _even((stretch.end - stretch.begin) / CELL)
        self._ahead = stretch.begin + CELL * (np.arange(count)[::-1] + 0.5)
        across = _even(2.0 * _HALF_WIDTH / CELL)
        self._aside = CELL * (np.arange(across) - (across - 1) / 2)
        sight = _seen(camera, horizon, *np.meshgrid(self._aside, self._ahead))
        columns, rows = sight.columns, sight.rows
        if rotate_180:
            columns, rows = camera.width - 1 - columns, camera.height - 1 - rows
        self._maps = cv2.convertMaps(
            columns.astype(np.float32), rows.astype(np.float32), cv2.CV_16SC2)
        self._levelling = horizon.levelling()
        self._to_road = np.array([
            [CELL, 0.0, self._aside[0]], [0.0, 0.0, 1.0], [0.0, -CELL, self._ahead[0]]])
        self._from_road = np.linalg.inv(self._to_road)
        self._noise = np.float32(_NOISE ** 2)
        self.window = self._weights(sight.seen, mask)
        """How much each cell counts, (M, N)."""
        total = float(self.window.sum())
        self.share = total / float(window_2d(Window.SQRT_HANN, self.shape).sum())
        """Which share of it is seen and not masked out."""
        self.middle = float(self._ahead @ self.window.sum(axis=1)) / max(total, 1e-9)
        """How far ahead its middle is, in heights."""

    @property
    def shape(self) -> tuple[int, int]:
        """Return the size of the patch, (M, N) cells."""
        return len(self._ahead), len(self._aside)

    def __call__(self, frame: Frame) -> NDArray[np.float32]:
        """
        Return the patch of a frame (H, W), freed of its light and shade: (M, N).

        From each cell the mean about it is taken, and the rest is divided by the contrast.
        """
        patch = np.asarray(self._taken(frame), np.float32)
        patch -= _smoothed(patch, _MEAN)
        contrast = _smoothed(np.square(patch), _CONTRAST)
        contrast += self._noise
        np.sqrt(contrast, out=contrast)
        patch /= contrast
        return patch

    def turned_back(
        self, patch: NDArray[np.float32], turn: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """
        Return what a patch would be had the camera not turned.

        Parameters
        ----------
        patch
            Of the frame after the turn, (M, N).
        turn
            Rotation (3, 3) of directions in the camera's picture axes, from before to after.

        """
        level = self._levelling @ turn @ self._levelling.T
        way = self._from_road @ level @ self._to_road
        return cv2.warpPerspective(  # type: ignore[return-value]
            patch, way, (patch.shape[1], patch.shape[0]),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE)

    def _taken(self, picture: Frame) -> Frame:
        return cv2.remap(  # type: ignore[return-value]
            picture, self._maps[0], self._maps[1], cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE)

    def _weights(
        self, seen: NDArray[np.bool_], mask: NDArray[np.float32] | None,
    ) -> NDArray[np.float32]:
        counts = seen.astype(np.float32)
        if mask is not None:
            counts *= self._taken(mask)
        # A hard edge would be a pattern of its own, that never moves.
        soft = cv2.blur(cv2.erode(counts, np.ones((5, 5), np.uint8)), (5, 5))
        return window_2d(Window.SQRT_HANN, self.shape) * np.asarray(soft, np.float32)


def rotation(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """Return how a camera's motion (see ``heading.camera_motion``) turns directions, (3, 3)."""
    turned, _ = cv2.Rodrigues(np.array([-pitch, yaw, -roll]))
    return np.asarray(turned, np.float64)


def _seen(
    camera: CameraModel, horizon: Horizon, aside: NDArray[np.float64], ahead: NDArray[np.float64],
) -> Sight:
    level = np.stack([aside, np.ones_like(aside), ahead], axis=-1)
    return camera.project(*np.moveaxis(level @ horizon.levelling(), -1, 0))


def _smoothed(patch: NDArray[np.float32], deviation: float) -> NDArray[np.float32]:
    # Two passes of a moving mean come close to a Gaussian, whatever its width.
    side = 2 * round(deviation) + 1
    for _ in range(2):
        patch = cv2.blur(patch, (side, side))  # type: ignore[assignment]
    return patch


def _even(number: float) -> int:
    return 2 * math.ceil(number / 2)
