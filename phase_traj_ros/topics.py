# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of topics that go together, by the conventions of ROS."""

# What the transports of image_transport append to the name of the image topic.
_TRANSPORTS = frozenset({
    'raw', 'compressed', 'compressedDepth', 'theora', 'zstd', 'ffmpeg', 'avif', 'h264'})


def camera_info_topic(image_topic: str) -> str:
    """
    Return the topic on which the CameraInfo for an image topic is found.

    It is beside it, as image_transport has it: the last part of the name is replaced, once what a
    transport has appended (as in ``/camera/image_raw/compressed``) is taken off.
    """
    parts = [part for part in image_topic.split('/') if part]
    while len(parts) > 1 and parts[-1] in _TRANSPORTS:
        parts.pop()
    return '/' + '/'.join([*parts[:-1], 'camera_info'])
