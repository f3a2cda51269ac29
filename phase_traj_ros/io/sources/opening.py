# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Opens any source of frames: a bag, a video or a folder of pictures.

A source is iterated over::

    with open_source('drive.mcap') as source:
        for frame in source:
            for outcome in stream.push(frame):
                print(outcome)
"""

from os import PathLike
from pathlib import Path

from phase_traj_ros.errors import ParameterError, reading, SourceError
from phase_traj_ros.io.sources.base import FrameSource
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection

_MIN_FPS, _MAX_FPS = 0.001, 1e6
_BAG_SUFFIXES = ('.mcap', '.db3', '.bag')
_COMPRESSED = ('.zstd', '.zst')


def open_source(
    path: str | PathLike[str],
    *,
    topic: str | None = None,
    selection: Selection = EVERYTHING,
    fps: float | None = None,
) -> FrameSource:
    """
    Open a bag, a video or a folder of pictures; ``path`` decides which.

    A directory with metadata.yaml and a .mcap or .db3 file are ROS 2 bags, a .bag file is a ROS 1
    bag, a directory with pictures (or a KITTI sequence) is a folder, any other file is a video.

    Parameters
    ----------
    path
        The bag, video or folder.
    topic
        The image topic of a bag; required if it has several.
    selection
        Which frames to use.
    fps
        Frames per second of a video or folder; overrides the stamps of the source.

    Raises
    ------
    SourceError
        path is missing, unreadable or empty, or the bag does not have the topic.
    ParameterError
        fps is not a finite number from 0.001 to 1,000,000.
    MissingDependencyError
        path is a bag, and no package that reads bags is installed.

    """
    path = Path(path)
    if fps is not None and not _MIN_FPS <= fps <= _MAX_FPS:
        raise ParameterError(f'fps must be a number from {_MIN_FPS} to {_MAX_FPS:.0f}, not {fps}')
    suffix = path.suffix.lower()
    with reading(path):
        is_directory = path.is_dir()
        is_bag = (path / 'metadata.yaml').exists() if is_directory else suffix in _BAG_SUFFIXES
        if not path.exists():
            raise SourceError(f'{path} does not exist')
        if not is_directory:
            if not path.is_file():
                raise SourceError(f'{path} is neither a file nor a directory')
            if path.stat().st_size == 0:
                raise SourceError(f'{path} is empty')
            if is_bag and suffix != path.suffix:
                raise SourceError(f'{path}: rename it to end in {suffix}, in lower case')
            if suffix in _COMPRESSED:
                raise SourceError(
                    f'{path} is compressed: give the folder of the bag, {path.parent}')

    # Imported here, so that only the packages in use are required and loaded.
    if is_bag:
        if fps is not None:
            raise SourceError(f'{path} is a bag: its images have stamps; leave out fps')
        from phase_traj_ros.io.sources.bag import BagSource
        return BagSource(path, topic=topic, selection=selection)
    if topic is not None:
        raise SourceError(
            f'{path} is a {"folder" if is_directory else "video"}, not a bag: it has no topics; '
            'leave out topic')
    if is_directory:
        from phase_traj_ros.io.sources.folder import FolderSource
        return FolderSource(path, selection=selection, fps=fps)
    from phase_traj_ros.io.sources.pyav_video import has_pyav, PyavSource
    from phase_traj_ros.io.sources.video import VideoSource
    return (PyavSource if has_pyav() else VideoSource)(path, selection=selection, fps=fps)
