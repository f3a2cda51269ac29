# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a camera, be it a number or a whole calibration."""

from dataclasses import dataclass

from phase_traj_ros.core.camera.model import CameraModel, MOST_FOCAL_PX
from phase_traj_ros.core.camera.projection import focal_from_hfov, LEAST_HFOV_DEG
from phase_traj_ros.errors import FrameError


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """
    What is known of the camera: one of the three is enough.

    Numbers that are given count before a calibration, as whoever gives them knows why.

    Raises
    ------
    ValueError
        None is given, or one is out of its range.

    """

    focal_px: float = 0.0
    """Focal length in pixels of the full frame; 0 if not known."""
    hfov_deg: float = 0.0
    """Horizontal field of view in degrees, from edge to edge; counts where the above is 0."""
    camera: CameraModel | None = None
    """The calibration, for frames of one size; counts where both of the above are 0."""

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0.0 <= self.focal_px <= MOST_FOCAL_PX:
            raise ValueError(
                f'focal_px is {self.focal_px}: give a number of pixels, at most'
                f' {MOST_FOCAL_PX:.0e}, or 0')
        if self.hfov_deg != 0.0 and not LEAST_HFOV_DEG <= self.hfov_deg < 180.0:
            raise ValueError(
                f'hfov_deg is {self.hfov_deg}: give degrees from {LEAST_HFOV_DEG} to below 180, or'
                ' 0')
        if self.focal_px == 0.0 and self.hfov_deg == 0.0 and self.camera is None:
            raise ValueError(
                'neither focal_px nor hfov_deg nor a calibration of the camera is known: give one'
                ' of them')

    @property
    def calibrated(self) -> bool:
        """Return whether it is the calibration that counts."""
        return self.focal_px == 0.0 and self.hfov_deg == 0.0

    def focal_for(self, width: int) -> float:
        """Return the (horizontal) focal length in pixels for frames ``width`` pixels wide."""
        if self.calibrated:
            assert self.camera is not None
            return self.camera.fx
        return self.focal_px or focal_from_hfov(self.hfov_deg, width)

    def camera_for(self, shape: tuple[int, int]) -> CameraModel:
        """
        Return the model of the camera for frames of this shape, (H, W).

        Raises
        ------
        FrameError
            The calibration counts, and is for pictures of another size.

        """
        if not self.calibrated or self.camera is None:
            return CameraModel.pinhole(shape, self.focal_for(shape[1]))
        if shape != self.camera.shape:
            raise FrameError(
                f'frames of {shape[1]}x{shape[0]} pixels, but the calibration of the camera is for'
                f' {self.camera.width}x{self.camera.height}: publish the camera_info that belongs'
                ' to the images, or give focal_px')
        return self.camera
