# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Replay of a film, as a whole process, beside decoding alone; writes docs/measurements/film.md.

    python -m benchmarks.speed.film [FILM] [--rounds N] [--repeat N]

Without a film, one is rendered into out/film (1080p at 30 Hz); that takes minutes once. It is
repeated N times, forward.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
import os
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any

from benchmarks.shared.report import disturbance, paragraphs, ROOT, table, versions, write_page
from benchmarks.shared.timing import Bystanders, bystanders, Quartiles, unpinned
import numpy as np
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import sensor_noise

_RATE = 30
_CAMERA = Camera.with_field_of_view(1920, 1080, 70)
_PLAN = [
    Straight(8), Turn(90, 3.5, 5), Straight(7), Turn(-90, 3, 5), Straight(8), Turn(30, 4),
    Straight(6), Turn(-60, 4, 6), Straight(8), Turn(90, 3.5, 5), Straight(5)]
# The peer that is much slower than the others gets the first frames only.
_FEW = 300

_DECODE = """
import cv2, sys
capture, frames = cv2.VideoCapture(sys.argv[1]), 0
while (read := capture.read())[0]:
    cv2.cvtColor(read[1], cv2.COLOR_BGR2GRAY)
    frames += 1
print(frames)
"""
_LUMA = """
import sys
from phase_traj_ros.io.sources.opening import open_source
print(sum(1 for frame in open_source(sys.argv[1])))
"""
_PEER = f"""
import cv2, numpy, sys
capture, frames, before = cv2.VideoCapture(sys.argv[1]), 0, None
while frames < {_FEW} and (read := capture.read())[0]:
    frame = numpy.float32(cv2.cvtColor(read[1], cv2.COLOR_BGR2GRAY))
    if before is None:
        window = cv2.createHanningWindow(frame.shape[::-1], cv2.CV_32F)
    else:
        cv2.phaseCorrelate(before, frame, window)
    before, frames = frame, frames + 1
print(frames)
"""
REPLAY = """
import sys
from phase_traj_ros.cli.main import main
sys.exit(main(['replay', sys.argv[1], '--output', 'results', '--force', *sys.argv[2:]]))
"""
_YARDSTICK = 'decoding and grey levels alone (OpenCV)'
CONTESTANTS: dict[str, tuple[str, list[str], float | None]] = {
    _YARDSTICK: (_DECODE, [], None),
    'luma alone (PyAV)': (_LUMA, [], None),
    '`replay`': (REPLAY, [], 2.0),
    '`replay --one-pass`': (REPLAY, ['--one-pass'], 1.5),
    '`replay -p code_source:=shift`': (REPLAY, ['-p', 'code_source:=shift'], 2.2),
    'OpenCV and `cv2.phaseCorrelate`': (_PEER, [], None),
}
"""Program, arguments after the film, and largest ratio to decoding alone."""


@dataclass(frozen=True, slots=True)
class Run:
    """One process: wall-clock and processor time in seconds, largest resident memory in bytes."""

    wall: float
    cpu: float
    peak: int


def run(program: str, arguments: list[str]) -> Run:
    """Run a program in a process of its own, as users do."""
    with TemporaryDirectory() as folder:
        began = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, '-c', program, *arguments], cwd=folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**unpinned(), 'PYTHONPATH': str(ROOT)})
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - began
    if status:
        raise SystemExit(f'{arguments} ended with {os.waitstatus_to_exitcode(status)}')
    return Run(wall, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024)


def rendered(folder: Path, camera: Camera = _CAMERA) -> Path:
    """Return a film of a drive through the rendered town, made if it is not there."""
    film = folder / f'town_{camera.height}.mp4'
    if not film.exists():
        folder.mkdir(parents=True, exist_ok=True)
        # The memory of this process would count as that of those that it starts later.
        with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as apart:
            apart.submit(_render, film, camera).result()
    return film


def _render(film: Path, camera: Camera) -> None:
    import av
    drive = plan_drive('', _PLAN, rate_hz=_RATE, speed=11.0, camera=camera, seed=17)
    part = film.with_name('part.mp4')
    with av.open(str(part), 'w') as container:
        stream = container.add_stream(
            'libx264', rate=_RATE, options={'crf': '23', 'preset': 'veryfast'})
        stream.width, stream.height, stream.pix_fmt = camera.width, camera.height, 'yuv420p'
        colourless = np.full((camera.height // 2, camera.width), 128, np.uint8)
        for number, grey in enumerate(render_drive(drive)):
            noisy = sensor_noise(grey, sigma=1.5, seed=number)
            frame = av.VideoFrame.from_ndarray(np.vstack([noisy, colourless]), format='yuv420p')
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    part.replace(film)


def repeated(film: Path, times: int, folder: Path) -> tuple[Path, int]:
    """Return a film that repeats another one, without encoding it again, and its frames."""
    import av
    path, frames, start = folder / 'film.mp4', 0, 0
    with av.open(str(path), 'w') as output:
        target: Any = None
        for _ in range(times):
            with av.open(str(film)) as container:
                source = container.streams.video[0]
                target = target or output.add_stream_from_template(source)
                end = 0
                for packet in container.demux(source):
                    if packet.dts is None:
                        continue
                    end = max(end, packet.pts + packet.duration)
                    packet.pts, packet.dts = packet.pts + start, packet.dts + start
                    packet.stream = target
                    output.mux(packet)
                    frames += 1
                start += end
    return path, frames


def measure(film: Path, rounds: int) -> dict[str, list[Run]]:
    """Return the runs of each contestant; they take turns."""
    runs: dict[str, list[Run]] = {name: [] for name in CONTESTANTS}
    for number in range(rounds):
        for name in (list(CONTESTANTS) if number % 2 == 0 else reversed(CONTESTANTS)):
            program, options, _ = CONTESTANTS[name]
            runs[name].append(run(program, [str(film), *options]))
            print(name, runs[name][-1], file=sys.stderr, flush=True)
    return runs


def page(runs: dict[str, list[Run]], frames: int, watched: Bystanders) -> Iterator[str]:
    """Yield the blocks of the page."""
    rounds, rows = len(runs[_YARDSTICK]), []
    for name, (program, _, limit) in CONTESTANTS.items():
        count = _FEW if program is _PEER else frames
        wall, cpu = (
            Quartiles.of(1e3 * value / count for value in each).median
            for each in ([one.wall for one in runs[name]], [one.cpu for one in runs[name]]))
        elapsed, used = (
            Quartiles.of(own / count / (base / frames) for own, base in each).median
            for each in zip(*(
                ((one.wall, base.wall), (one.cpu, base.cpu))
                for one, base in zip(runs[name], runs[_YARDSTICK]))))
        rows.append((
            name, f'{wall:.1f}', f'{cpu:.1f}', f'{elapsed:.2f}', f'{used:.2f}',
            '' if limit is None else f'{limit:g}',
            f'{max(one.peak for one in runs[name]) / 1e6:.0f}'))
    header = ('1080p, whole process', 'time, ms/frame', 'processor, ms/frame', 'ratio of times',
              'of processor times', 'aim', 'memory, MB')
    introduction = paragraphs(f"""
        This page shows how long a replay of a video takes, beside decoding it.

        A replay takes less than 1.5 times as long as decoding the video alone, in one pass hardly
        longer than that, and by the paper's rule less than twice as long.

        The video is a drive through the rendered town with the noise of a sensor, 1920×1080 at
        {_RATE} Hz, H.264, {frames:,} frames. Each row is a whole process from its start to its
        end, with the results of `--output` written. The *time* is wall-clock time, the *processor*
        time that of all threads, both the median of {rounds} round{"s" if rounds > 1 else ""}, in
        which all take turns. The ratios are to decoding alone in the same round; beside other
        programs, that of the processor times is the more reliable one. The *aim* is for the ratio
        of the times on two idle cores. The memory is the largest resident memory.
        `cv2.phaseCorrelate` gets the first {_FEW} frames.

        The default learns the camera in a first pass, which ends early in longer videos. Of this
        one it took the first 31 %; the focal length was 0.1 % off.

        Written by `benchmarks/speed/film.py` (`make film`) on {os.cpu_count()} cores, with
        {versions()}.
        """)
    yield from (
        '# Replay of a long video', introduction, table(header, rows), disturbance(watched))


def main() -> None:
    """Run the program."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('film', type=Path, nargs='?')
    parser.add_argument('--rounds', type=int, default=5)
    parser.add_argument('--repeat', type=int, default=3)
    chosen = parser.parse_args()
    film = chosen.film or rendered(ROOT / 'out' / 'film')
    with TemporaryDirectory() as folder:
        long, frames = repeated(film.absolute(), chosen.repeat, Path(folder))
        with bystanders() as watched:
            runs = measure(long, chosen.rounds)
        write_page('film', page(runs, frames, watched))


if __name__ == '__main__':
    main()
