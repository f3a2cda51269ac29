# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Derives topic names by the conventions of ROS."""

# Suffixes that image_transport appends to the name of the image topic.
_TRANSPORTS = frozenset({
    'raw', 'compressed', 'compressedDepth', 'theora', 'zstd', 'ffmpeg', 'avif', 'h264'})


def camera_info_topic(image_topic: str) -> str:
    """
    Return the topic of the CameraInfo for an image topic.

    As in image_transport, the last part of the name is replaced, after the suffix of a transport
    (as in ``/camera/image_raw/compressed``) is removed.
    """
    parts = [part for part in image_topic.split('/') if part]
    while len(parts) > 1 and parts[-1] in _TRANSPORTS:
        parts.pop()
    return '/' + '/'.join([*parts[:-1], 'camera_info'])
