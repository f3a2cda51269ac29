# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Memory of a replay of an hour of film; writes its section of docs/measurements/film.md.

    python -m benchmarks.speed.hour

The film is small, as the memory of a frame's size does not depend on the number of frames: the
page adds what grows to the memory of a film at 1080p.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.shared.report import MEASUREMENTS, paragraphs, ROOT, table, write_page
from benchmarks.speed.film import rendered, repeated, REPLAY, run
from phase_traj_ros.synthetic import Camera

_TITLE = '## An hour'
_FRAMES = 108_000
_CAMERA = Camera.with_field_of_view(320, 180, 70)
_WAYS: dict[str, tuple[list[str], int]] = {
    '`replay --one-pass`': (['--one-pass'], 200),
    '`replay`': ([], 350),
}
"""Options, and the most memory that an hour should take, in MB."""


def section() -> str:
    """Measure; return the section of the page."""
    rows = []
    with TemporaryDirectory() as folder:
        short = rendered(ROOT / 'out' / 'film', _CAMERA)
        _, some = repeated(short, 1, Path(folder))
        film, frames = repeated(short, -(-_FRAMES // some), Path(folder))
        for name, (options, aim) in _WAYS.items():
            early, late = (run(REPLAY, [str(each), *options]) for each in (short, film))
            rows.append((
                name, f'{early.peak / 1e6:.0f}', f'{late.peak / 1e6:.0f}', str(aim),
                f'{(late.peak - early.peak) / (frames - some):.0f}',
                f'{1e3 * late.cpu / frames:.1f}'))
    introduction = paragraphs(f"""
        The same at {_CAMERA.width}×{_CAMERA.height}, a minute and an hour long: {some:,} and
        {frames:,} frames. The memory is the largest resident memory of the whole process, with the
        results written. What the frames take does not depend on their number, so an hour at 1080p
        takes that of the table above, and as many megabytes more as an hour takes here.
        """)
    header = ('whole process', 'a minute, MB', 'an hour, MB', 'aim', 'bytes per pair',
              'processor, ms/frame')
    return f'{_TITLE}\n\n{introduction}\n\n{table(header, rows)}'


def main() -> None:
    """Run the program."""
    film = (MEASUREMENTS / 'film.md').read_text(encoding='utf-8')
    write_page('film', (film.partition(_TITLE)[0].rstrip(), section()))


if __name__ == '__main__':
    main()
