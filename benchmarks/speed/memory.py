# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Memory allocated by a step in steady state: nothing of a frame's size.

Three instruments are used, as none covers everything. tracemalloc counts what Python and numpy
allocate. Page faults also cover the buffers inside OpenCV; they are counted in a separate process,
whose malloc requests every large buffer from the kernel, which clears it page by page. The
resident memory shows whether anything is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import resource
import subprocess
import sys
import tracemalloc

from benchmarks.shared.clips import Clip, rendered_clip
from benchmarks.shared.peers import OpenCv, Ours, Peer
from benchmarks.shared.report import paragraphs, table
from benchmarks.shared.timing import prepare, unpinned
import cv2
from phase_traj_ros.synthetic import KITTI_CAMERA

_FRAMES = 8
_STEPS, _FAULT_STEPS, _WARM_UP = 2000, 200, 10
_PAGE = resource.getpagesize()
#: Above this size malloc requests memory from the kernel each time, and returns it at once.
_EAGER = {'MALLOC_MMAP_THRESHOLD_': str(2 ** 16), 'MALLOC_TOP_PAD_': '0'}

PEERS = {'step': Ours, 'cv2.phaseCorrelate': OpenCv}

INTRODUCTION = paragraphs("""
    After the first frames, a step allocates no buffer of a frame's size (376×1241 is 466,616
    bytes); only numpy's conversion buffers remain, and their size does not depend on the frame.
    *Peak* is the most that Python and numpy hold during a step beyond what they held before it.
    *Paged in* is what the kernel gives the process per step when malloc returns every large
    buffer, so it includes the buffers inside OpenCV. *Growth* is how much larger the process is
    after 2000 steps.
    """)


@dataclass(frozen=True, slots=True)
class Memory:
    """Memory used by a step, in bytes."""

    name: str
    peak: int
    paged_in: int
    growth: int


def resident(process: int | str = 'self') -> int:
    """Return the resident memory of this or another process, in bytes."""
    return int(Path(f'/proc/{process}/statm').read_text().split()[1]) * _PAGE


def peak_of_a_step(peer: Peer, clip: Clip) -> int:
    """Return the peak memory that a step allocates through Python and numpy, in bytes."""
    peaks = []
    tracemalloc.start()
    try:
        for frame in clip.there_and_back(_WARM_UP + _FRAMES):
            tracemalloc.reset_peak()
            before, _ = tracemalloc.get_traced_memory()
            peer.update(frame)
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    return max(peaks[_WARM_UP:])


def growth(peer: Peer, clip: Clip) -> int:
    """Return the growth of the process over many steps, in bytes."""
    for frame in clip.there_and_back(_WARM_UP):
        peer.update(frame)
    before = resident()
    for frame in clip.there_and_back(_STEPS):
        peer.update(frame)
    return resident() - before


def faults(peer: Peer, clip: Clip) -> int:
    """Return the page faults of this process per step, in bytes."""
    for frame in clip.there_and_back(_WARM_UP):
        peer.update(frame)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for frame in clip.there_and_back(_FAULT_STEPS):
        peer.update(frame)
    pages = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
    return pages * _PAGE // _FAULT_STEPS


def _faults_elsewhere(name: str) -> int:
    done = subprocess.run(
        [sys.executable, '-m', 'benchmarks.speed.memory', name], env={**unpinned(), **_EAGER},
        text=True, stdout=subprocess.PIPE, check=True)
    return int(done.stdout)


def _clip() -> Clip:
    return rendered_clip(KITTI_CAMERA, count=_FRAMES)


def measure() -> list[Memory]:
    """Return the memory used by a step of the correlator and of OpenCV's."""
    clip = _clip()
    return [
        Memory(
            name, peak_of_a_step(make(), clip), _faults_elsewhere(name), growth(make(), clip))
        for name, make in PEERS.items()]


def section(rows: list[Memory]) -> str:
    """Return the results as Markdown."""
    cells = [(row.name, *(f'{value:,}' for value in (row.peak, row.paged_in, row.growth)))
             for row in rows]
    header = ('bytes', 'peak', 'paged in', 'growth')
    return f'## Memory of a step\n\n{INTRODUCTION}\n\n{table(header, cells)}'


def main() -> None:
    """Run the program."""
    if len(sys.argv) == 2:
        cv2.setNumThreads(1)
        print(faults(PEERS[sys.argv[1]](), _clip()))
        return
    prepare()
    print(section(measure()))


if __name__ == '__main__':
    main()
