# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The calibration of a camera from a sensor_msgs/CameraInfo.

This module does not need ROS: it accepts any object with the fields of the message, such as those
of rclpy and rosbags. ROS 1 writes D, K and P, ROS 2 d, k and p.

Sources: the comments of sensor_msgs/CameraInfo and sensor_msgs/RegionOfInterest, REP 104.
"""

from typing import Any

from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.errors import CalibrationError

CAMERA_INFO_TYPE = 'sensor_msgs/msg/CameraInfo'
"""Name of the message type."""

# The names of sensor_msgs/distortion_models, and the name that the ROS 1 calibrator writes for the
# last of them.
_MODELS = {
    'plumb_bob': Distortion.BROWN,
    'rational_polynomial': Distortion.BROWN,
    'equidistant': Distortion.FISHEYE,
    'fisheye': Distortion.FISHEYE,
}
# Number of coefficients of plumb_bob.
_PLUMB_BOB = 5


def camera_from_info(message: Any, *, rectified: bool) -> CameraModel:
    """
    Return the camera model for the images that a CameraInfo belongs to.

    K and P are for the whole sensor. The model is for the images as they arrive, i.e. after
    cropping to the region of interest and binning. If all distortion coefficients are zero, there
    is no distortion, unless the model is equidistant.

    Parameters
    ----------
    message
        A sensor_msgs/CameraInfo of rclpy or rosbags, of ROS 2 or ROS 1.
    rectified
        Whether the images are rectified: P describes them, and they have no distortion.
        Otherwise K, D and distortion_model describe them.

    Raises
    ------
    CalibrationError
        The camera is not calibrated, its distortion model is unknown, or a value is invalid.

    """
    matrix = _numbers(message, 'p' if rectified else 'k')
    # A test that the comments of the message definition recommend.
    if matrix[0] == 0.0:
        raise CalibrationError(
            f'the camera is not calibrated ({"P" if rectified else "K"}[0] of the camera_info is'
            ' 0): calibrate it, or give focal_px or hfov_deg')
    x, y, width, height = _region(message)
    columns, rows = message.binning_x or 1, message.binning_y or 1
    coefficients = _numbers(message, 'd')
    distortion = Distortion.NONE
    if not rectified:
        distortion = _distortion(message.distortion_model, coefficients)
    step = len(matrix) // 3
    try:
        return CameraModel(
            width=width // columns, height=height // rows,
            fx=matrix[0] / columns, fy=matrix[step + 1] / rows,
            cx=_centre(matrix[2], x, columns), cy=_centre(matrix[step + 2], y, rows),
            distortion=distortion,
            coefficients=() if distortion is Distortion.NONE else coefficients)
    except ValueError as error:
        raise CalibrationError(f'the camera_info cannot be used: {error}') from error


def camera_info_fields(
    camera: CameraModel, *, rectified: CameraModel | None = None,
) -> dict[str, object]:
    """
    Return the fields of the CameraInfo, without the header, for images of ``camera``.

    ``rectified`` is the model of the same images after rectification, for P. If it is not given
    and there is no distortion, the images count as rectified.
    """
    if rectified is None and camera.distortion is Distortion.NONE:
        rectified = camera
    projection = [0.0] * 12
    if rectified is not None:
        projection = [
            rectified.fx, 0.0, rectified.cx, 0.0, 0.0, rectified.fy, rectified.cy, 0.0, 0.0, 0.0,
            1.0, 0.0]
    name = 'equidistant'
    if camera.distortion is not Distortion.FISHEYE:
        name = 'plumb_bob' if len(camera.coefficients) <= _PLUMB_BOB else 'rational_polynomial'
    return {
        'width': camera.width, 'height': camera.height, 'distortion_model': name,
        'd': list(camera.coefficients) or [0.0] * _PLUMB_BOB,
        'k': [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0],
        'r': [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], 'p': projection,
    }


def _numbers(message: Any, name: str) -> tuple[float, ...]:
    """Return the numbers of a field, whose name is upper case in ROS 1."""
    found = getattr(message, name if hasattr(message, name) else name.upper())
    return tuple(float(value) for value in found)


def _region(info: Any) -> tuple[int, int, int, int]:
    """Return the part of the sensor that the image shows: x, y, width and height."""
    roi = info.roi
    x, y, width, height = roi.x_offset, roi.y_offset, roi.width, roi.height
    if not (x or y or width or height):
        width, height = info.width, info.height
    if x + width > info.width or y + height > info.height:
        raise CalibrationError(
            f'the region of interest of the camera_info, {width}x{height} pixels at ({x}, {y}),'
            f' extends beyond the {info.width}x{info.height} pixels it is calibrated for: correct'
            ' it, or give focal_px')
    return x, y, width, height


def _centre(centre: float, offset: int, binning: int) -> float:
    """Convert a coordinate from pixels of the sensor to pixels of the image."""
    # The centre of the first image pixel is in the middle of the sensor pixels it combines.
    return (centre - offset + 0.5) / binning - 0.5


def _distortion(name: str, coefficients: tuple[float, ...]) -> Distortion:
    """Return the distortion model for a name of sensor_msgs/distortion_models."""
    found = _MODELS.get(name)
    if not any(coefficients) and (found is Distortion.BROWN or not name):
        return Distortion.NONE
    if found is None:
        raise CalibrationError(
            f'the distortion model {name!r} of the camera_info is unknown (known:'
            f' {", ".join(_MODELS)}): give focal_px, or rectify the images')
    return found
