# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of the KITTI clips, which several tests read."""

from functools import lru_cache

import cv2


@lru_cache(maxsize=2)
def grey_pictures(clip):
    """Return the pictures of the left grey camera of a clip, given by its folder."""
    pictures = [
        cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        for file in sorted((clip / 'image_0').glob('*.png'))]
    for picture in pictures:
        picture.flags.writeable = False
    return pictures
