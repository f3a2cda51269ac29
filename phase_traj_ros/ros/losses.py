# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do about images that are lost on the way."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from ament_index_python.packages import get_package_share_directory, PackageNotFoundError

PROFILE: Final = 'config/fastdds_large_images.xml'
_PACKAGE = 'phase_traj_ros'
# Either of them names a file of profiles; the first is the older name.
_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
# The shared memory of Fast DDS has half a megabyte, unless a profile says otherwise.
_SEGMENT_BYTES = 512 * 1024


def advice(image_bytes: int, middleware: str, environment: Mapping[str, str]) -> str:
    """
    Return what to do where images are lost, as the end of a sentence.

    Parameters
    ----------
    image_bytes
        Size of an image as it comes.
    middleware
        Name of the implementation of ROS's middleware, such as ``rmw_fastrtps_cpp``.
    environment
        Variables of this process.

    """
    profiled = any(environment.get(name) for name in _VARIABLES)
    if image_bytes > _SEGMENT_BYTES // 2 and 'fastrtps' in middleware and not profiled:
        return (f'an image of {image_bytes / 1e6:.1f} MB is too large for the shared memory that'
                f' Fast DDS has by default: set {_VARIABLES[0]}={_profile()} for the camera driver'
                ' and for this node')
    return ('the network loses them, or they come faster than they are handled: see p99 in'
            ' /diagnostics; a higher decimation takes less time')


def _profile() -> str:
    try:
        return str(Path(get_package_share_directory(_PACKAGE)) / PROFILE)
    except (PackageNotFoundError, OSError):
        # Installed by pip: then there is no index of packages, or this one is not in it.
        return PROFILE
