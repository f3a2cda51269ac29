# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the tests of quality were chosen: for measurements, standing still and fixed patterns.

Every candidate is tried on the same pairs of frames. Takes about ten minutes; writes
docs/measurements/quality.md and the curves in docs/images.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import partial
import time
from typing import TypeVar

from benchmarks.quality import gate, lock, stillness, turns
from benchmarks.quality.curves import IMAGES, say
from benchmarks.quality.data import driving
from benchmarks.shared.clips import Clip
from benchmarks.shared.report import paragraphs, table, versions, write_page
import cv2
import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.correlation.block_motion import BlockMotion
from phase_traj_ros.core.correlation.quality import StillnessDetector
from phase_traj_ros.core.correlation.tuning import TUNING

_FRAMES = 60

Result = TypeVar('Result')

_INTRODUCTION = """
    This page shows how well three tests detect pairs that are not measurements, standing vehicles,
    and patterns that are fixed to the camera.

    The significance of the peak separates good pairs from unrelated frames far better than the
    response does. The motion of the blocks, averaged over a few pairs, detects a standing vehicle
    under almost all conditions; a vehicle that passes and fills most of the picture defeats it.
    Against a fixed pattern, `shift.look_past_zero` recovers most of the turning pairs, and a mask
    recovers nearly all of them, except those that the fixed noise of a sensor disturbs.

    The paper judges every pair by its shift, so a covered lens, a scene cut or a stop at a red
    light is coded as driving straight on. The tests are off in `config/paper.yaml`.
    `config/vehicle.yaml` turns on the test for a standing vehicle; the others are
    `shift.min_significance` and `shift.look_past_zero`. Each candidate was tried on the same
    pairs: the clips of the KITTI odometry benchmark where they are available, and rendered drives
    (`phase_traj_ros.synthetic`), some of them along the true poses of KITTI drives. In the curves,
    lower left is better, and the circle marks the chosen test.

    Written by `benchmarks/quality/quality.py` with {versions}.
    """


def cost_section(clip: Clip) -> str:
    """Return the cost of the tests per frame, as a share of the correlation."""
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
            timed('stillness', partial(detector.update, flow, 0.1, frame.shape[1]))
            second = timed('second peak', partial(
                correlator.second_peak, apart=TUNING.peak_distance_px))
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
    write_page('quality', (
        '# Quality of the pairs',
        paragraphs(_INTRODUCTION.format(versions=versions())),
        gate.section(gate.measure(clips)),
        stillness.section(stillness.measure(clips)),
        lock.section(lock.measure(clips), lock.measure_passing(clips)),
        turns.section(turns.measure(clips)),
        cost_section(clips[0])))


if __name__ == '__main__':
    main()
