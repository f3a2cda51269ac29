# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Advice for images that are lost in transport."""

from collections.abc import Mapping

from phase_traj_ros.io.params_file import config_folder

PROFILE = 'fastdds_large_images.xml'
# Either variable names a profile file; the first is the older name.
_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
# Default size of the shared memory of Fast DDS; a profile can change it.
_SEGMENT_BYTES = 512 * 1024


def advice(image_bytes: int, middleware: str, environment: Mapping[str, str]) -> str:
    """
    Return what to do about lost images, as the end of a sentence.

    Parameters
    ----------
    image_bytes
        Size of an image as received.
    middleware
        Name of the middleware implementation, such as ``rmw_fastrtps_cpp``.
    environment
        Environment variables of this process.

    """
    profiled = any(environment.get(name) for name in _VARIABLES)
    if image_bytes > _SEGMENT_BYTES // 2 and 'fastrtps' in middleware and not profiled:
        return (f'an image of {image_bytes / 1e6:.1f} MB is too large for the default shared'
                f' memory of Fast DDS: set {_VARIABLES[0]}={config_folder() / PROFILE} for the'
                ' camera driver and for this node')
    return ('the network loses them, or they arrive faster than they are processed: see p99 in'
            ' /diagnostics; fewer images per second, or smaller ones, reduce the processing time')
