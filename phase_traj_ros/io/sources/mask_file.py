# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the mask file given by the parameters."""

from pathlib import Path

from phase_traj_ros.core.correlation.mask import mask_shares
from phase_traj_ros.errors import ParameterError, SourceError
from phase_traj_ros.io.images.decoding import GreyImage, read_picture
from phase_traj_ros.parameters import Parameters


def read_mask(parameters: Parameters) -> GreyImage | None:
    """
    Return the mask in ``mask_file``, (H, W) uint8 or uint16; None if it is not given.

    Raises
    ------
    ParameterError
        The file cannot be read, or the mask is empty: black everywhere.

    """
    if not parameters.mask_file:
        return None
    try:
        picture = read_picture(Path(parameters.mask_file).expanduser())
        mask_shares(picture)
    except (SourceError, ValueError) as error:
        raise ParameterError(f'mask_file: {error}') from None
    return picture
