# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the tests of quality were chosen: what tells a measurement, standing still, a fixed pattern.

Every candidate is tried on the same pairs of frames. Takes some ten minutes; writes
docs/measurements/quality.md and the curves in docs/images.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import partial
import time
from typing import TypeVar

from clips import Clip
import cv2
import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.correlation.block_motion import BlockMotion
from phase_traj_ros.core.correlation.quality import StillnessDetector
from quality_curves import IMAGES, say
from quality_data import driving
import quality_gate
import quality_lock
import quality_stillness
import quality_turns
from report import paragraphs, ROOT, table, versions

_DOCUMENT = ROOT / 'docs' / 'measurements' / 'quality.md'
_FRAMES = 60
_APART = 8

Result = TypeVar('Result')

_INTRODUCTION = """
    The paper judges every pair of frames by its shift. A covered lens, a scene cut and a vehicle
    at a red light then drive straight on. These tests, off in `config/paper.yaml` and on in
    `config/vehicle.yaml`, tell such pairs apart. They were chosen by trying each candidate on the
    same pairs: the clips of the KITTI odometry benchmark where they are at hand, and rendered
    drives (`phase_traj_ros.synthetic`), some of them along the true poses of KITTI drives. In the
    curves below, down and left is better; the circle is where the test chosen stands.

    Written by `benchmarks/quality.py` with {versions}.
    """


def cost_section(clip: Clip) -> str:
    """Return what the tests cost per frame, as a share of the correlation."""
    correlator, blocks, detector = PhaseCorrelator(), BlockMotion(), StillnessDetector()
    spent: dict[str, list[float]] = defaultdict(list)

    def timed(name: str, call: Callable[[], Result]) -> Result:
        began = time.perf_counter()
        result = call()
        spent[name].append(time.perf_counter() - began)
        return result

    for frame in clip.frames[:_FRAMES]:
        shift = timed('correlation', partial(correlator.update, frame))
        if timed('reduced frame', partial(blocks.update, frame)):
            assert shift is not None
            timed('significance', partial(correlator.significance, shift))
            flow = timed('motion of the blocks', blocks.flow)
            timed('stillness', partial(detector.update, flow, frame.shape[1]))
            second = timed('second peak', partial(correlator.second_peak, apart=_APART))
            timed('share of the blocks', partial(blocks.share_following, second))
    base = np.median(spent.pop('correlation'))
    at_zero = ('second peak', 'share of the blocks')
    return '\n\n'.join(('## Cost', table(
        (f'{clip.camera.width}×{clip.camera.height}', 'share of the correlation, %', 'when'),
        [(name, f'{100 * np.median(each) / base:.0f}',
          'peak at zero' if name in at_zero else 'every pair')
         for name, each in spent.items()])))


def main() -> None:
    """Run the program."""
    cv2.setNumThreads(1)
    clips = driving()
    say('clips rendered')
    IMAGES.mkdir(exist_ok=True)
    text = '\n\n'.join((
        '# Quality: what is a measurement, and what stands still',
        paragraphs(_INTRODUCTION.format(versions=versions())),
        quality_gate.section(quality_gate.measure(clips)),
        quality_stillness.section(quality_stillness.measure(clips)),
        quality_lock.section(quality_lock.measure(clips), quality_lock.measure_passing(clips)),
        quality_turns.section(quality_turns.measure(clips)),
        cost_section(clips[0]))) + '\n'
    _DOCUMENT.write_text(text, encoding='utf-8')
    print(f'\n{text}')


if __name__ == '__main__':
    main()
