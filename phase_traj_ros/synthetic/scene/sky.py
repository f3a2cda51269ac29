# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The sky and the hills below it, infinitely far away: they rotate, but never come nearer."""

from dataclasses import dataclass

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import Bytes
from phase_traj_ros.synthetic.camera import Camera
from phase_traj_ros.synthetic.textures.noise import spectral_noise

#: Pixels of the panorama per full turn, and per unit of the elevation's tangent.
_TURN = 4096
_SCALE = _TURN / (2 * np.pi)
#: The panorama extends up to this tangent of the elevation, and down to minus a quarter of it.
_HIGHEST = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class Sky:
    """A panorama of two full turns, ``horizon`` rows of which are above the horizon."""

    panorama: Bytes
    horizon: int

    def draw(self, picture: Bytes, camera: Camera, yaw: float) -> None:
        """Draw all rows of ``picture`` down to the horizon, as seen by a level camera."""
        rows = np.arange(min(max(int(np.floor(camera.cy)) + 1, 0), camera.height))
        if not len(rows):
            return
        slope = (np.arange(camera.width) - camera.cx) / camera.focal
        azimuth = np.arctan(slope)
        # The panorama runs clockwise, like the columns of the image.
        turn = (azimuth[0] - yaw) % (2 * np.pi) + (azimuth - azimuth[0])
        steep = _SCALE / (camera.focal * np.sqrt(1.0 + slope * slope))
        columns = np.broadcast_to((turn * _SCALE).astype(np.float32), (len(rows), camera.width))
        heights = np.outer((rows - camera.cy).astype(np.float32), steep.astype(np.float32))
        heights += np.float32(self.horizon)
        picture[:len(rows)] = cv2.remap(
            self.panorama, np.ascontiguousarray(columns), heights, cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE)


def build_sky(rng: np.random.Generator) -> Sky:
    """Paint clouds, brighter towards the horizon, and a line of wooded hills."""
    horizon = round(_HIGHEST * _SCALE)
    height = horizon + round(_HIGHEST * _SCALE / 4)
    elevation = (horizon - np.arange(height))[:, None] / _SCALE
    # Clouds are soft: a quarter of the resolution is enough.
    clouds = cv2.resize(
        spectral_noise(rng, height // 4, _TURN // 4, slope=1.5), (_TURN, height),
        interpolation=cv2.INTER_CUBIC)
    picture = 222.0 - 110.0 * np.clip(elevation, 0.0, 1.0) + 9.0 * clouds
    hills = 0.02 + 0.006 * spectral_noise(rng, 1, _TURN, slope=1.0)[0]
    wooded = slice(horizon - 64, horizon)
    woods = 112.0 + 9.0 * spectral_noise(rng, 64, _TURN, slope=0.6)
    picture[wooded] = np.where(elevation[wooded] < hills, woods, picture[wooded])
    picture[horizon:] = 112.0
    panorama = np.tile(np.clip(picture, 0, 255).astype(np.uint8), (1, 2))
    panorama.flags.writeable = False
    return Sky(panorama, horizon)
