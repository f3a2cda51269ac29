# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One step with the OpenCV of the wheels and with that of the distribution, side by side.

Two versions of OpenCV cannot be loaded into one process. So each is measured by itself, relative
to its own function for the same task, and the ratios are compared. The latest measurement of each
is kept in docs/measurements/benchmarks.json. Run as a program, this measures the Python it runs
with as the distribution's, and writes the result to docs/measurements/benchmarks.md.
"""

from __future__ import annotations

from collections.abc import Callable
import json
import sys
from typing import Any

from benchmarks.shared.clips import Clip, usual_clips
from benchmarks.shared.peers import BareTransforms, Heading, OpenCv, Ours
from benchmarks.shared.report import disturbance, MEASUREMENTS, paragraphs, table, verdict
from benchmarks.shared.timing import bystanders, prepare, take_turns
import cv2
import numpy as np
from phase_traj_ros.core.correlation.transforms import find_transform

WHEELS, SYSTEM = 'wheels', 'system'
TITLE = "## The distribution's OpenCV"
_DOCUMENT = MEASUREMENTS / 'benchmarks.md'
_KEPT = _DOCUMENT.with_suffix('.json')
_FRAMES, _ROUNDS, _WARM_UP = 40, 120, 5
_HEADING = 'heading, cylinder and blocks'

INTRODUCTION = paragraphs("""
    This table compares the step with the OpenCV of PyPI's wheels (`make bench`) and with that of
    the distribution (`make bench-system`, with the distribution's Python, OpenCV and scipy), each
    beside its own peers. The *peer* is `cv2.phaseCorrelate`; or one forward and one inverse
    transform of the padded size, with the library that the step uses; or the complete measurement
    of the heading, which is a step on the cylinder plus its blocks.
    """)

#: The peers, and the target for the ratio on the distribution's OpenCV at the three sizes.
PEERS: dict[str, tuple[Callable[[Clip], Any], tuple[float | None, ...]]] = {
    'cv2.phaseCorrelate': (lambda _: OpenCv(), (0.36, 0.36, 0.40)),
    'bare transforms': (lambda clip: BareTransforms(clip.shape), (1.6, 1.6, None)),
}


def measure() -> dict[str, Any]:
    """Return the description of this installation, and the medians of all peers at each size."""
    results: dict[str, Any] = {
        'python': sys.version.split()[0], 'numpy': np.__version__, 'opencv': cv2.__version__,
        'transforms': find_transform().name, 'frames': []}
    with bystanders() as watched:
        for clip in usual_clips(_FRAMES):
            rows = {name: _duel(clip, make(clip).update) for name, (make, _) in PEERS.items()}
            rows[_HEADING] = _duel(clip, Heading(clip.camera).update)
            height, width = clip.shape
            results['frames'].append({'frame': f'{height}×{width}, {clip.name}', 'ms': rows})
    results['meanwhile'] = disturbance(watched)
    return results


def _duel(clip: Clip, peer: Callable[[np.ndarray], Any]) -> tuple[float, float]:
    """Return the medians of the step and of a peer, in milliseconds."""
    timed = take_turns(
        {'step': Ours().update, 'peer': peer}, clip.there_and_back(_ROUNDS + _WARM_UP),
        warm_up=_WARM_UP)
    return round(timed['step'].ms, 3), round(timed['peer'].ms, 3)


def keep(name: str, results: dict[str, Any]) -> None:
    """Store the results of an installation, replacing earlier ones."""
    known = kept() | {name: results}
    _KEPT.write_text(json.dumps(known, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')


def kept() -> dict[str, Any]:
    """Return the latest results of each installation."""
    return json.loads(_KEPT.read_text(encoding='utf-8')) if _KEPT.exists() else {}


def section(installations: dict[str, Any]) -> str:
    """Return both columns as Markdown."""
    names = [name for name in (WHEELS, SYSTEM) if name in installations]
    lines = [
        '- *{}*: Python {python}, numpy {numpy}, OpenCV {opencv}; transforms by {transforms}. '
        '{meanwhile}'.format(name, **installations[name]) for name in names]
    header = ['frame', 'against']
    for name in names:
        header += [f'{name}: step, ms', f'{name}: peer, ms', f'{name}: ratio']
    rows = []
    for index, each in enumerate(installations[names[-1]]['frames']):
        for peer in (*PEERS, _HEADING):
            row, ratio = [each['frame'], peer], 0.0
            for name in names:
                step, other = installations[name]['frames'][index]['ms'][peer]
                ratio = step / other
                row += [f'{step:.2f}', f'{other:.2f}', f'{ratio:.3f}']
            limit = PEERS[peer][1][index] if peer in PEERS and SYSTEM in names else None
            rows.append([*row, '' if limit is None else f'{limit:g}', verdict(ratio, limit)])
    return '\n\n'.join([TITLE, INTRODUCTION, paragraphs('\n\n'.join(lines)),
                        table([*header, 'at most', 'met'], rows)])


def wheels_section() -> str:
    """Measure this environment as that of the wheels; return both columns as Markdown."""
    keep(WHEELS, measure())
    return section(kept())


def main() -> None:
    """Run the program."""
    prepare()
    keep(SYSTEM, measure())
    text = section(kept())
    print(text)
    before, found, after = _DOCUMENT.read_text(encoding='utf-8').partition(TITLE)
    rest = after.partition('\n## ')[2]
    _DOCUMENT.write_text(
        f'{before}{text}\n\n## {rest}' if found else f'{before}\n{text}\n', encoding='utf-8')
    print(f'written to {_DOCUMENT}')


if __name__ == '__main__':
    main()
