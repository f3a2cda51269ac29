# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Run all benchmarks except robustness; write docs/measurements/benchmarks.md."""

from __future__ import annotations

from collections.abc import Callable
import sys
import time

from benchmarks.shared.report import machine, paragraphs, write_page
from benchmarks.shared.timing import prepare
from benchmarks.speed import installations, memory, node_throughput, options, replay, sizes, steps

INTRODUCTION = paragraphs("""
    This page compares the speed of the package with that of its peers.

    A step of the correlator takes about half the time of `cv2.phaseCorrelate` and about a tenth of
    the time of feature tracking with an essential matrix. It allocates no buffer of a frame's
    size, so memory stays constant. The node keeps up with cameras of well over 100 frames per
    second, most of which it foresees; at 10 Hz, a frame costs it more than the aim. A replay by
    the rule of the paper takes a fifth longer than the slower of decoding and correlation.

    `make bench` measures everything side by side in one run of less than ten minutes and writes
    this page. The absolute figures hold for one machine; the ratios carry over to others. `make
    robustness` measures the [robustness](robustness.md) to noise.
    """)

METHOD = paragraphs("""
    glibc's malloc may return large buffers to the kernel and request them again, depending on
    earlier calls, and the same call then takes up to three times as long. So the variables above
    pin the allocator wherever steps are compared, and the contestants take turns in one process.
    """)


def sections() -> dict[str, Callable[[], str]]:
    """Return the measurements, each with a name for the progress display."""
    return {
        'step against peers': lambda: steps.section(*steps.measure()),
        'installations': installations.wheels_section,
        'padded sizes': sizes.section,
        'options': options.section,
        'memory': lambda: memory.section(memory.measure()),
        'node over DDS': lambda: node_throughput.section(*node_throughput.measure()),
        'replay': lambda: replay.section(*replay.measure()),
    }


def main() -> None:
    """Run the program."""
    prepare()
    began = time.monotonic()
    parts = ['# Benchmarks', INTRODUCTION, machine(), METHOD]
    for name, section in sections().items():
        print(f'{name} ...', file=sys.stderr, flush=True)
        parts.append(section())
        print(f'\n{parts[-1]}\n', flush=True)
    write_page('benchmarks', parts)
    print(f'after {time.monotonic() - began:.0f} s')


if __name__ == '__main__':
    main()
