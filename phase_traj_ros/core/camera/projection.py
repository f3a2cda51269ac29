# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Conversion of pixels to angles, and the projection of frames onto a cylinder.

Image axes are columns to the right and rows down, with the centre of the first pixel at (0, 0).
Azimuths are positive to the right, like columns. Yaw is positive to the left (REP 103). If the
camera turns left by an angle, all content moves to the right by the same angle, so a shift on the
cylinder and the yaw have the same sign.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.lens_family import MAX_FOCAL_PX, Numbers
from phase_traj_ros.core.camera.model import CameraModel, Distortion, ImagePoints
from phase_traj_ros.core.camera.tuning import CameraTuning, TUNING
from phase_traj_ros.core.correlation.phase_correlation import Frame, MIN_SIDE
from phase_traj_ros.core.correlation.view import reduced
from phase_traj_ros.errors import FrameError

# OpenCV's remap has 16-bit pixel coordinates.
_MOST_SIDE = 32766

MIN_HFOV_DEG = 0.1
"""Smallest field of view in degrees, below that of any camera on a vehicle."""


class CylinderProjection:
    """
    Projects the frames of a camera onto a cylinder about the vertical axis of the camera.

    On the cylinder, a yaw is the same horizontal shift over the whole width. In the image of a
    pinhole camera, a yaw a moves content at the azimuth t by f a / cos(t)**2. A point of the
    cylinder has an azimuth t and a slope y, the tangent of its angle below the horizontal plane.
    A camera without distortion images it at

        x = cx + fx tan(t),    y' = cy + fy y / cos(t).

    The mapping, including the distortion, is computed once. A frame then needs one ``cv2.remap``,
    after a reduction by an integer factor if the resolution of the camera is much higher than
    required.
    """

    def __init__(self, camera: CameraModel, *, tuning: CameraTuning = TUNING) -> None:
        """
        Compute the mapping from the upright frames of a camera to the cylinder.

        ``tuning`` gives the band of the view and the resolution of the cylinder.

        Raises
        ------
        FrameError
            The camera shows too little of the band, or the frames are too large.

        """
        left, right, above, below = _extent(camera, tuning)
        usual = max(tuning.usual_px_per_rad, tuning.min_columns / max(right - left, 1e-9))
        reduction = max(round(camera.fx / usual), 1)
        self.px_per_rad = camera.fx / reduction
        """
        Resolution of the cylinder in pixels per radian, in both directions.

        A shift to the right divided by it is the yaw in radians, positive to the left.
        """
        self._reduction = (
            max(int(min(camera.fy / self.px_per_rad + 1e-9, MAX_FOCAL_PX)), 1), reduction)
        self.azimuths = self._samples(left, right)
        """Azimuth of each column in radians, positive to the right."""
        self.slopes = self._samples(-above, below)
        """Slope y of each row, positive down."""
        self._check_sizes(camera)
        sight = _project(camera, self.azimuths, self.slopes)
        self.inside = sight.seen
        """
        Which pixels of the cylinder are inside the frame, of size ``shape``.

        Towards the sides, the frame covers fewer rows of the cylinder. Outside of the frame, and
        of the range of a distortion model, its edge is repeated.
        """
        columns, rows = sight.columns, sight.rows
        scanned = slice(None, None, TUNING.scanline_row_step)
        self._scanned = cv2.convertMaps(
            columns[scanned].astype(np.float32), rows[scanned].astype(np.float32), cv2.CV_16SC2)
        self._maps = cv2.convertMaps(
            _reduced(columns, self._reduction[1]), _reduced(rows, self._reduction[0]),
            cv2.CV_16SC2)

    def __call__(self, frame: Frame) -> Frame:
        """Return a frame of the camera, (H, W), on the cylinder, (rows, columns), in its type."""
        return cv2.remap(  # type: ignore[return-value]
            reduced(frame, *self._reduction), *self._maps, cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE)

    def scanline(self, frame: Frame) -> NDArray[np.float32]:
        """Return the mean of some rows of the cylinder, (1, columns), for a tenth of the cost."""
        rows = cv2.remap(frame, *self._scanned, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return cv2.reduce(  # type: ignore[return-value]
            rows, 0, cv2.REDUCE_AVG, dtype=cv2.CV_32F)

    @property
    def shape(self) -> tuple[int, int]:
        """Return the size of the projected frames, (rows, columns)."""
        return len(self.slopes), len(self.azimuths)

    def _check_sizes(self, camera: CameraModel) -> None:
        height, width = camera.shape
        down, across = self._reduction
        if min(self.shape) < MIN_SIDE:
            raise FrameError(
                f'with a focal length of {camera.fx:.6g} pixels, frames of {width}x{height} pixels'
                ' show too little to measure yaw: give the right focal_px or hfov_deg')
        if max(*self.shape, height // down, width // across) > _MOST_SIDE:
            raise FrameError(
                f'with focal lengths of {camera.fx:.6g} and {camera.fy:.6g} pixels, frames of'
                f' {width}x{height} pixels are too large to measure yaw: give the right focal_px'
                ' or hfov_deg')

    def _samples(self, low: float, high: float) -> Numbers:
        # Limited, so that a wrong size is reported before it exhausts the memory.
        count = int(min(max(0.0, (high - low) * self.px_per_rad), _MOST_SIDE + 1))
        most = (count - 1) / 2 / self.px_per_rad
        middle = (low + high) / 2
        return np.linspace(middle - most, middle + most, count)


def _project(camera: CameraModel, azimuths: Numbers, slopes: Numbers) -> ImagePoints:
    """Return the image positions of each slope (rows) at each azimuth (columns)."""
    return camera.project(
        np.tan(azimuths), np.outer(slopes, 1 / np.cos(azimuths)), np.ones((1, 1)))


def _extent(camera: CameraModel, band: CameraTuning) -> tuple[float, float, float, float]:
    """
    Return the visible part of the band: azimuths left and right, slopes above and below.

    The band is given in angles and not in fractions of the image, so it is the same part of the
    scene for any camera. Where it reaches beyond the image, they are those of the edges to the
    left, right, above and below of the optical axis. Towards the corners, the edges depend on the
    lens.
    """
    aside = math.radians(band.side_deg)
    highest, lowest = (math.tan(math.radians(angle)) for angle in (band.above_deg, band.below_deg))
    if camera.distortion is Distortion.NONE:
        return (
            max(math.atan(-(camera.cx + 0.5) / camera.fx), -aside),
            min(math.atan((camera.width - 0.5 - camera.cx) / camera.fx), aside),
            min((camera.cy + 0.5) / camera.fy, highest),
            min((camera.height - 0.5 - camera.cy) / camera.fy, lowest))
    # A cropped image may not contain the optical axis: use the point nearest to it.
    slopes = np.linspace(-highest, lowest, TUNING.search_grid[0])
    azimuths = np.linspace(-aside, aside, TUNING.search_grid[1])
    distance = np.hypot(slopes[:, None], azimuths)
    distance[~_project(camera, azimuths, slopes).seen] = math.inf
    row, column = np.unravel_index(distance.argmin(), distance.shape)
    if math.isinf(distance[row, column]):
        return 0.0, 0.0, 0.0, 0.0
    middle, azimuths = azimuths[[column]], np.linspace(-aside, aside, TUNING.search_steps)
    level, slopes = slopes[[row]], np.linspace(-highest, lowest, TUNING.search_steps)
    left, right = _visible_range(azimuths, _project(camera, azimuths, level).seen[0], middle)
    above, below = _visible_range(slopes, _project(camera, middle, slopes).seen[:, 0], level)
    return left, right, -above, below


def _visible_range(
    values: Numbers, seen: NDArray[np.bool_], start: Numbers,
) -> tuple[float, float]:
    """Return the first and last of the values around ``start`` that are all seen."""
    nearest = int(np.abs(values - start).argmin())
    before, after = np.flatnonzero(~seen[:nearest]), np.flatnonzero(~seen[nearest:])
    first = before[-1] + 1 if before.size else 0
    last = nearest + after[0] - 1 if after.size else len(values) - 1
    return float(values[first]), float(values[last])


def _reduced(position: Numbers, times: int) -> NDArray[np.float32]:
    """Convert pixel coordinates of the frame to those of the reduced frame."""
    return ((position + 0.5) / times - 0.5).astype(np.float32)
