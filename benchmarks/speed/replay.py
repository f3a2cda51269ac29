# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Offline replay: how well decoding and correlation overlap, and whether memory stays constant.

Reading ahead helps if decoding releases Python's lock. Three tasks alternate on the same folder:
decoding alone, correlation alone (of frames in memory), and the replay of the command line. With
two cores the replay should take little longer than the slower of the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
import tempfile

from benchmarks.shared.clips import Clip, kitti_clip, rendered_clip
from benchmarks.shared.report import disturbance, paragraphs, table, verdict
from benchmarks.shared.timing import Bystanders, bystanders, prepare, take_turns
from benchmarks.speed.memory import resident
import cv2
import numpy as np
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import index_stamp_ns, StampedFrame
from phase_traj_ros.io.sources.folder import FolderSource
from phase_traj_ros.io.sources.prefetch import prefetch
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Camera, KITTI_CAMERA
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest

_FRAMES, _ROUNDS, _WARM_UP = 120, 7, 1
_FORMATS = ('png', 'jpg')
_LIMIT = 1.3
_LONG, _EARLY = 20_000, 2_000
# The default takes two passes over an unknown camera, see docs/how-to/camera.md.
_PAPER = Parameters(code_source='shift')
_SMALL = Camera.with_field_of_view(620, 188, 81)
#: A pair keeps a few small objects; a frame of the small camera has 116,560 bytes.
_LARGEST_RECORD = 2000

INTRODUCTION = paragraphs("""
    A folder of pictures (376×1241, grey) is replayed as `phase_traj replay` does it, with the
    rule of the paper: one pass, with the next pictures decoded in the background. *Decode* and
    *correlate* are the two parts, each measured alone. All three take turns; the times are
    medians of wall-clock time, with OpenCV's transforms on one thread. The ratio is that of the
    replay to the slower part.
    """)


@dataclass(frozen=True, slots=True)
class Overlap:
    """Wall-clock time of the replay of a folder, in seconds."""

    name: str
    decode: float
    correlate: float
    replay: float

    @property
    def ratio(self) -> float:
        """Return the time of the replay relative to the slower of its parts."""
        return self.replay / max(self.decode, self.correlate)


@dataclass(frozen=True, slots=True)
class Growth:
    """Growth of memory over a long replay, in bytes."""

    pairs: int
    early: int
    late: int

    @property
    def per_pair(self) -> float:
        """Return the growth of memory per pair, in bytes."""
        return (self.late - self.early) / (_LONG - _EARLY)


def measure_folder(clip: Clip, suffix: str) -> Overlap:
    """Return the time to replay a folder of such images."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number, frame in enumerate(clip.frames):
            cv2.imwrite(str(folder / f'{number:06}.{suffix}'), frame)
        decoded = list(FolderSource(folder))

        request = ReplayRequest(source=folder, parameters=_PAPER)
        timed = take_turns({
            'decode': lambda _: sum(1 for _ in FolderSource(folder)),
            'correlate': lambda _: len(replay(decoded, _PAPER, source=suffix).updates),
            'replay': lambda _: len(replay_source(FolderSource(folder), request).updates)},
            range(_ROUNDS + _WARM_UP), warm_up=_WARM_UP)
    seconds = {part: float(np.median(each.wall)) for part, each in timed.items()}
    return Overlap(suffix.upper(), **seconds)


def measure_growth() -> Growth:
    """Return the growth of memory over a long replay."""
    clip = rendered_clip(_SMALL, count=20)
    seen: list[int] = []

    def frames() -> Iterator[StampedFrame]:
        for number, image in enumerate(clip.there_and_back(_LONG)):
            if number in (_EARLY, _LONG - 1):
                seen.append(resident())
            # A copy, as frames read from files are separate arrays.
            yield StampedFrame(image.copy(), index_stamp_ns(number, 10.0))

    with closing(prefetch(frames())) as ahead:
        result = replay(ahead, _PAPER, source='rendered')
    return Growth(len(result.updates), *seen)


def measure() -> tuple[list[Overlap], Bystanders, Growth]:
    """Return the times to replay folders, the load of other programs, and the memory growth."""
    clip = kitti_clip('00', count=_FRAMES) or rendered_clip(KITTI_CAMERA, count=_FRAMES)
    with bystanders() as watched:
        overlaps = [measure_folder(clip, suffix) for suffix in _FORMATS]
    return overlaps, watched, measure_growth()


def section(overlaps: list[Overlap], watched: Bystanders, growth: Growth) -> str:
    """Return the results as Markdown."""
    rows = [(each.name, *(f'{1e3 * seconds / _FRAMES:.2f}' for seconds in (
        each.decode, each.correlate, each.replay)), f'{each.ratio:.2f}', f'{_LIMIT:g}',
        verdict(each.ratio, _LIMIT)) for each in overlaps]
    header = ('folder', 'decode, ms/frame', 'correlate, ms/frame', 'replay, ms/frame', 'ratio',
              'at most', 'met')
    flat = growth.per_pair <= _LARGEST_RECORD
    memory = paragraphs(f"""
        Memory over {_LONG:,} frames of {_SMALL.height}×{_SMALL.width} (116,560 bytes each):
        {growth.early / 2 ** 20:.1f} MiB after {_EARLY:,} frames, {growth.late / 2 ** 20:.1f} MiB
        at the end, which is {growth.per_pair:.0f} bytes per pair: the result's record of it, and
        {"nothing else" if flat else "**more than that**"}.
        """)
    return (f'## Replay\n\n{INTRODUCTION}\n\n{table(header, rows)}\n\n'
            f'{disturbance(watched)}\n\n{memory}')


if __name__ == '__main__':
    prepare()
    print(section(*measure()))
