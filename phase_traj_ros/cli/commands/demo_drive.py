# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The rendered drive of a demo: made, and replayed offline."""

from pathlib import Path

from phase_traj_ros.cli.progress import progress
from phase_traj_ros.io.replay.camera import known_lens
from phase_traj_ros.io.replay.run import Replay, replay
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Drive, write_drive_bag


def render(drive: Drive, bag: Path) -> None:
    """Render a drive to a bag."""
    print(f'rendering {len(drive)} frames of the drive {drive.name!r} ...', flush=True)
    with progress(total=len(drive), title='rendering') as bar:
        write_drive_bag(drive, bag, progress=bar.update)


def replay_bag(bag: Path, parameters: Parameters, *, named: Path) -> Replay:
    """Replay a rendered drive in one pass; ``named`` is the place that the bag will have."""
    with open_source(bag) as source:
        shown = progress(source, total=source.frame_count, title='replaying')
        return replay(shown, parameters, source=str(named), lens=known_lens(source, parameters)[0])
