# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a learned camera as a ROS parameter file."""

from pathlib import Path

from phase_traj_ros.core import CameraEstimate, CameraInUse, Lens
from phase_traj_ros.core.camera.lens_family import OneNumberLens
from phase_traj_ros.core.camera.projection import MIN_HFOV_DEG
from phase_traj_ros.parameters import specs
import yaml

CAMERA_FILE = 'camera.yaml'
# Above this, the edges of the image are so far from a pinhole that the focal length is written.
_MOST_HFOV_DEG = 175.0


def camera_values(estimate: CameraEstimate) -> dict[str, float]:
    """
    Return the parameters that describe a camera, by name.

    This is the field of view, which is valid for images of any size, unless the lens is so wide
    that only the focal length describes it.
    """
    offset = _allowed('lens_offset', estimate.column_px / estimate.width)
    straightness = _allowed('lens_straightness', estimate.straightness)
    lens = OneNumberLens(estimate.focal_px, straightness)
    hfov_deg = lens.hfov_deg(estimate.width, column=offset * estimate.width)
    known = (
        {'hfov_deg': round(hfov_deg, 2)} if MIN_HFOV_DEG <= hfov_deg <= _MOST_HFOV_DEG
        else {'focal_px': round(estimate.focal_px, 2)})
    return {
        **known, 'lens_straightness': straightness, 'lens_offset': offset,
        'camera_pitch_deg': _allowed('camera_pitch_deg', estimate.pitch_deg, digits=2),
        'camera_roll_deg': _allowed('camera_roll_deg', estimate.roll_deg, digits=2)}


def write_camera(estimate: CameraEstimate, path: Path, *, rotate_180: bool = False) -> None:
    """Write a parameter file for ``--params`` and for the node."""
    known = CameraInUse.of(Lens(estimate=estimate), estimate.width)
    turned = {'rotate_180': True} if rotate_180 else {}
    values = yaml.safe_dump(
        {'/**': {'ros__parameters': {**camera_values(estimate), **turned}}}, sort_keys=False)
    path.write_text(
        f'# A camera of {estimate.width}x{estimate.height} pixels.\n# {known}\n{values}',
        encoding='utf-8')


def _allowed(name: str, value: float, *, digits: int = 4) -> float:
    [spec] = [each for each in specs() if each.name == name]
    assert spec.minimum is not None and spec.maximum is not None
    # Adding 0 converts -0 to 0.
    return round(min(max(value, spec.minimum), spec.maximum), digits) + 0.0
