# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Renders a scene from a camera and its pose."""

from functools import partial

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import as_bytes, Bytes, Floats, Ints, Singles
from phase_traj_ros.synthetic.camera import Camera, level_view, Pose
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.synthetic.textures.atlas import in_ripmap, level_of
from phase_traj_ros.synthetic.view.panorama import draw_fisheye
from phase_traj_ros.synthetic.view.visibility import cut, Strips, visible

#: Distance at which the air has reduced all contrast to 1 / e, in metres.
_VISIBILITY = 900.0
_AIR = 190.0
#: Blur of a lens in focus, in pixels.
_LENS = 0.45


def render(scene: Scene, camera: Camera, pose: Pose) -> Bytes:
    """
    Return what ``camera`` sees of ``scene`` from ``pose``, (height, width) uint8.

    A pure function: the same arguments give the same image. The image of a tilted camera is a
    level one, warped by the exact homography; raises `ParameterError` if the tilt is too large. A
    fisheye image is composed of level ones.
    """
    if camera.fisheye is not None:
        return draw_fisheye(camera, pose, partial(_render_level, scene))
    if pose.pitch == 0 and pose.roll == 0:
        level = _render_level(scene, camera, pose)
        return as_bytes(cv2.GaussianBlur(level, (3, 3), _LENS))
    # The interpolation blurs as much as the lens.
    (view, homography) = level_view(camera, pose.pitch, pose.roll)
    return as_bytes(cv2.warpPerspective(
        _render_level(scene, view, pose), homography, (camera.width, camera.height),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE))


def _render_level(scene: Scene, camera: Camera, pose: Pose) -> Bytes:
    picture = np.empty((camera.height, camera.width), np.uint8)
    scene.sky.draw(picture, camera, pose.yaw)
    scene.ground.draw(picture, camera, pose)
    strips = cut(scene.panels, scene.materials.silhouettes, camera, pose)
    if len(strips.panel):
        (walls, mask) = _draw_panels(scene, camera, strips)
        cv2.copyTo(walls, mask, picture)
    return picture


def _spread(values: Floats, length: Ints, camera: Camera) -> Singles:
    """Assign to every pixel the value of its run; (width, height), so columns are contiguous."""
    spread: Singles = np.repeat(values.astype(np.float32), length)
    return spread.reshape(camera.width, camera.height)


def _draw_panels(scene: Scene, camera: Camera, strips: Strips) -> tuple[Bytes, Bytes]:
    """Return the pixels of the panels, and a mask of them."""
    (panels, atlas) = (scene.panels, scene.materials.atlas)
    (strip, length) = visible(strips, camera)
    # Runs without a strip look up an arbitrary one; the mask removes them.
    panel = strips.panel[strip]
    (depth, along) = (strips.depth[strip], strips.along[strip])
    texture = panels.texture[panel]
    density = atlas.density[texture]

    across = level_of(strips.stretch[strip] * density)
    upwards = level_of(depth / camera.focal * density)
    offset = np.clip(panels.offset[panel] + along, 0.0, atlas.length[texture])
    columns = in_ripmap(atlas.left[texture] + offset * density, across, atlas.image.shape[1])
    # The row in the atlas is linear in the row of the image.
    (step, at_horizon) = (depth / camera.focal, camera.above_ground - panels.base[panel])
    top = in_ripmap(
        atlas.bottom[texture] - (at_horizon + camera.cy * step) * density, upwards,
        atlas.image.shape[0])
    slope = step * density * 0.5 ** upwards

    rows = _spread(slope, length, camera)
    rows *= np.arange(camera.height, dtype=np.float32)
    rows += _spread(top, length, camera)
    walls = cv2.remap(
        atlas.image, _spread(columns, length, camera), rows, cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE).astype(np.float32)
    clear = np.exp(-depth / _VISIBILITY)
    walls *= _spread(clear * panels.gain[panel], length, camera)
    walls += _spread((1.0 - clear) * _AIR, length, camera)
    np.clip(walls, 0, 255, out=walls)
    mask = np.repeat((strip >= 0).astype(np.uint8), length).reshape(camera.width, camera.height)
    return (as_bytes(cv2.transpose(walls.astype(np.uint8))), as_bytes(cv2.transpose(mask)))
