# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bird's-eye patches of the road.

The road is a plane, one unit (the camera height) below the camera. A point on it is z ahead and x
to the right. In a level frame with x to the right, y down and z in the direction of travel, the
camera sees it in the direction (x, 1, z).
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.lens_family import Numbers
from phase_traj_ros.core.camera.model import CameraModel, ImagePoints
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.correlation.windows import window_2d
from phase_traj_ros.core.road.tuning import TUNING

CELL = 0.03
"""Side of a cell in camera heights: 5 cm for a camera 1.65 m above the road."""


def stretches(camera: CameraModel, levelling: Numbers) -> tuple[tuple[float, float], ...]:
    """
    Return the near and the far stretch of the road that a camera resolves.

    ``levelling`` (3, 3) rotates the image axes to those of a level camera that points in the
    direction of travel. Each stretch is from a start to an end ahead, in camera heights. The
    result is empty if too little of the road is visible.
    """
    ahead = np.arange(TUNING.patch_begin, TUNING.patch_end, CELL)
    rows, resolved = _rows_per_cell(camera, levelling, ahead)
    resolved = np.append(resolved, False)
    first = int(resolved.argmax())
    last = first + int(resolved[first:].argmin())
    begin, length = float(ahead[first]), float(ahead[last] - ahead[first])
    if length < TUNING.min_length or rows[first:last].sum() < TUNING.min_rows:
        return ()
    return (
        (begin, begin + TUNING.near_ends * length),
        (begin + TUNING.far_begins * length, begin + length))


class GroundPatch:
    """
    Projects frames to a patch of the road, and compensates patches for rotations of the camera.

    Rows of a patch are ordered from far to near, columns from left to right.
    """

    def __init__(
        self, camera: CameraModel, levelling: Numbers, stretch: tuple[float, float], *,
        mask: NDArray[np.float32] | None = None,
    ) -> None:
        """
        Compute the mapping from a frame to the patch.

        ``camera`` is the model of the upright image, ``levelling`` as in ``stretches``,
        ``stretch`` the start and the end of the patch ahead, in camera heights, and ``mask``
        the weight of each pixel, (H, W), 0 to 1.
        """
        begin, end = stretch
        count = _even((end - begin) / CELL)
        # The rows of the patch, and those ahead of it that the camera resolves.
        ahead = np.asarray(
            begin + CELL * (np.arange(count + round(TUNING.max_offset / CELL)) + 0.5), np.float64)
        rows_per_cell, resolved = _rows_per_cell(camera, levelling, ahead)
        self.max_offset = int(np.append(resolved[count - 1:], False).argmin())
        """Largest offset of the patch, in cells."""
        ahead = ahead[:count + self.max_offset][::-1]
        self._ahead = ahead[self.max_offset:]
        across = _even(2.0 * TUNING.half_width / CELL)
        self._aside = CELL * (np.arange(across) - (across - 1) / 2)
        sight = _seen(camera, levelling, *np.meshgrid(self._aside, ahead))
        self._maps = cv2.convertMaps(
            sight.columns.astype(np.float32), sight.rows.astype(np.float32), cv2.CV_16SC2)
        self._levelling = levelling
        self.window = self._weights(sight.seen[self.max_offset:], mask)
        """Weight of each cell, (M, N)."""
        total = float(self.window.sum())
        self.share = total / float(window_2d(self.shape).sum())
        """Share of the patch that is visible and not masked out, 0 to 1."""
        self.depth = float(self._ahead @ self.window.sum(axis=1)) / max(total, 1e-9)
        """Weighted mean distance of the patch ahead, in camera heights."""
        self.blur_cells = TUNING.interpolation_blur / float(np.median(rows_per_cell[:count - 1]))
        """Standard deviation of the blur along the road in a pair of patches, in cells."""

    @property
    def shape(self) -> tuple[int, int]:
        """Return the size of the patch, (M, N) cells."""
        return len(self._ahead), len(self._aside)

    def __call__(self, frame: Frame, offset: int = 0) -> NDArray[np.float32]:
        """
        Return the patch of a frame (H, W), without illumination and shadows, (M, N).

        Each cell loses the local mean and is divided by the local contrast. The patch is moved
        ahead by an ``offset`` in cells, at most ``max_offset``.
        """
        patch = np.asarray(self._remapped(frame, offset), np.float32)
        patch -= _smoothed(patch, TUNING.mean_cells)
        contrast = _smoothed(np.square(patch), TUNING.contrast_cells)
        contrast += TUNING.noise_levels ** 2
        np.sqrt(contrast, out=contrast)
        patch /= contrast
        return patch

    def derotated(
        self, patch: NDArray[np.float32], turn: Numbers, roll: float = 0.0, offset: int = 0,
    ) -> NDArray[np.float32]:
        """
        Return a patch (M, N) with a rotation of the camera removed.

        ``turn`` is the rotation (3, 3) of directions in the image axes, from before to after.
        ``roll`` is that before, relative to the patch, in radians, positive right side down.
        ``offset`` is that of the patch, in cells.
        """
        to_road = np.array([
            [CELL, 0.0, self._aside[0]], [0.0, 0.0, 1.0],
            [0.0, -CELL, self._ahead[0] + CELL * offset]])
        sine, cosine = math.sin(roll), math.cos(roll)
        upright = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]
        level = self._levelling @ turn @ self._levelling.T @ upright
        homography = np.linalg.inv(to_road) @ level @ to_road
        return cv2.warpPerspective(  # type: ignore[return-value]
            patch, homography, (patch.shape[1], patch.shape[0]),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE)

    def _remapped(self, picture: Frame, offset: int = 0) -> Frame:
        first = self.max_offset - offset
        columns, rows = (each[first:first + len(self._ahead)] for each in self._maps)
        return cv2.remap(  # type: ignore[return-value]
            picture, columns, rows, cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE)

    def _weights(
        self, seen: NDArray[np.bool_], mask: NDArray[np.float32] | None,
    ) -> NDArray[np.float32]:
        counts = seen.astype(np.float32)
        if mask is not None:
            counts *= self._remapped(mask)
        # A hard edge would be a pattern that never moves.
        soft = cv2.blur(cv2.erode(counts, np.ones((5, 5), np.uint8)), (5, 5))
        return window_2d(self.shape) * np.asarray(soft, np.float32)


def rotation(yaw: float, pitch: float, roll: float) -> Numbers:
    """
    Return the matrix (3, 3) that rotates directions by a motion of the camera, in radians.

    ``yaw`` is positive to the left, ``pitch`` nose up, ``roll`` right side down.
    """
    turned, _ = cv2.Rodrigues(np.array([-pitch, yaw, -roll]))
    return np.asarray(turned, np.float64)


def _rows_per_cell(
    camera: CameraModel, levelling: Numbers, ahead: Numbers,
) -> tuple[Numbers, NDArray[np.bool_]]:
    """Return the image rows between neighbours of (N,) cells ahead, and if they are resolved."""
    sight = _seen(camera, levelling, np.zeros_like(ahead), ahead)
    rows = np.abs(np.diff(sight.rows))
    return rows, sight.seen[1:] & sight.seen[:-1] & (rows > CELL / TUNING.max_row_spacing)


def _seen(camera: CameraModel, levelling: Numbers, aside: Numbers, ahead: Numbers) -> ImagePoints:
    level = np.stack([aside, np.ones_like(aside), ahead], axis=-1)
    return camera.project(*np.moveaxis(level @ levelling, -1, 0))


def _smoothed(patch: NDArray[np.float32], deviation: float) -> NDArray[np.float32]:
    # Two passes of a moving mean approximate a Gaussian at a cost independent of its width.
    side = 2 * round(deviation) + 1
    for _ in range(2):
        patch = cv2.blur(patch, (side, side))  # type: ignore[assignment]
    return patch


def _even(number: float) -> int:
    return 2 * math.ceil(number / 2)
