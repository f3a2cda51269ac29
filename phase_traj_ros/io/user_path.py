# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Paths as users write them."""

from pathlib import Path

from phase_traj_ros.errors import ParameterError


def user_path(given: str) -> Path:
    """
    Return a path whose ``~`` or ``~name`` is replaced by the folder of the user.

    Raises
    ------
    ParameterError
        There is no such user, or the user has no folder.

    """
    try:
        return Path(given).expanduser()
    except RuntimeError:
        raise ParameterError(f'{given}: there is no such user: write the whole path') from None
