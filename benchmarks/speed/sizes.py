# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The padding rule of the correlator against other rules, on common camera sizes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from benchmarks.shared.report import disturbance, paragraphs, table, transforms
from benchmarks.shared.timing import bystanders, prepare, take_turns, Timed
import cv2
import numpy as np
from phase_traj_ros.core.correlation.spectrum import padded_side

#: (H, W) of KITTI, of webcams and of industrial cameras.
SHAPES = (
    (240, 320), (370, 1226), (375, 1242), (376, 1241), (480, 640), (480, 752), (512, 1392),
    (540, 960), (600, 960), (720, 1280), (964, 1288), (1080, 1920), (1200, 1920))
_WARM_UP = 2

INTRODUCTION = paragraphs("""
    The padded size determines the time of the two transforms and of the product of the spectra.
    The table gives their processor time at the size that
    `phase_traj_ros.core.correlation.spectrum.padded_side` chooses, and the factor by which other
    rules are slower (above 1) or faster (below 1). *5-smooth* is the next even product of 2, 3 and
    5. *Optimal* is `cv2.getOptimalDFTSize`; it cannot be used directly, because odd sides are not
    packed as the correlator needs them, and a padding of one pixel distorts the peak. *×16* is the
    next multiple of 16, *2^n* the next power of two, and *none* the frame's own size. All sizes of
    a row take turns in an order that is shuffled every round.
    """)


def even_smooth(length: int) -> int:
    """Return the next even product of 2, 3 and 5."""
    return 2 * cv2.getOptimalDFTSize((length + 1) // 2)


def multiple(factor: int, length: int) -> int:
    """Return the next multiple of ``factor``."""
    return -(-length // factor) * factor


def power_of_two(length: int) -> int:
    """Return the next power of two."""
    return 1 << (length - 1).bit_length()


RULES: dict[str, Callable[[int], int]] = {
    'rule': padded_side,
    '5-smooth': even_smooth,
    'optimal': cv2.getOptimalDFTSize,
    '×16': partial(multiple, 16),
    '2^n': power_of_two,
    'none': lambda length: length,
}


class Transforms:
    """The two transforms and the product of the spectra at one padded size."""

    def __init__(self, shape: tuple[int, int]) -> None:
        rng = np.random.default_rng(0)
        self._frame = rng.normal(size=shape).astype(np.float32)
        self._spectrum, self._cross, self._map = (np.empty_like(self._frame) for _ in range(3))

    def __call__(self, _: int) -> None:
        """Do what a step does with a whole spectrum, except for the whitening."""
        cv2.dft(self._frame, dst=self._spectrum)
        cv2.mulSpectrums(self._spectrum, self._spectrum, 0, self._cross, conjB=True)
        cv2.dft(self._cross, dst=self._map, flags=cv2.DFT_INVERSE)


@dataclass(frozen=True, slots=True)
class Row:
    """Cost of the rules at one size of frame."""

    shape: tuple[int, int]
    padded: dict[str, tuple[int, int]]
    timed: dict[tuple[int, int], Timed]

    def ms(self, rule: str) -> float:
        """Return the median at the size that ``rule`` gives."""
        return self.timed[self.padded[rule]].ms

    def relative(self, rule: str) -> float:
        """Return the time with ``rule`` relative to that of the correlator's rule."""
        return self.ms(rule) / self.ms('rule')


def measure(shape: tuple[int, int], rounds: int) -> Row:
    """Return the cost of each rule at this size; equal sizes are measured once."""
    padded = {name: (rule(shape[0]), rule(shape[1])) for name, rule in RULES.items()}
    timed = take_turns(
        {each: Transforms(each) for each in set(padded.values())}, range(rounds + _WARM_UP),
        warm_up=_WARM_UP)
    return Row(shape, padded, timed)


def section() -> str:
    """Measure; return the results as Markdown."""
    parts = ['## Padded sizes', INTRODUCTION]
    usual = cv2.ipp.useIPP()
    with bystanders() as watched:
        # OpenCV's own transforms take several times as long as Intel's.
        for ipp, rounds in ((True, 40), (False, 10)) if usual else ((False, 10),):
            cv2.ipp.setUseIPP(ipp)
            rows = [measure(shape, rounds) for shape in SHAPES]
            parts += [f'OpenCV {cv2.__version__} {transforms()}:', _table(rows)]
    cv2.ipp.setUseIPP(usual)
    return '\n\n'.join([*parts, disturbance(watched)])


def _table(rows: list[Row]) -> str:
    others = [name for name in RULES if name != 'rule']
    cells: list[tuple[str, ...]] = [(
        '×'.join(map(str, row.shape)), '×'.join(map(str, row.padded['rule'])),
        f'{row.ms("rule"):.2f}', *(f'{row.relative(name):.2f}' for name in others))
        for row in rows]
    means = [float(np.exp(np.mean([np.log(row.relative(name)) for row in rows])))
             for name in others]
    cells.append(('geometric mean', '', '', *(f'{mean:.2f}' for mean in means)))
    return table(('frame', 'padded', 'ms', *others), cells)


if __name__ == '__main__':
    prepare()
    print(section())
