# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the mask that the parameters name."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.mask import mask_weights
from phase_traj_ros.errors import ParameterError, SourceError
from phase_traj_ros.io.images.picture_file import read_picture
from phase_traj_ros.parameters import Parameters


def read_mask(parameters: Parameters) -> NDArray[np.uint8] | None:
    """
    Return the mask of ``mask_file``, (H, W) uint8, or None where none is named.

    Raises
    ------
    ParameterError
        It cannot be read, or leaves nothing of the frames.

    """
    if not parameters.mask_file:
        return None
    try:
        picture = read_picture(Path(parameters.mask_file))
        mask_weights(picture)
    except (SourceError, ValueError) as error:
        raise ParameterError(f'mask_file: {error}') from None
    shades = picture if picture.dtype == np.uint8 else picture >> 8
    return shades.astype(np.uint8)
