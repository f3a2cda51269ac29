# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Run all benchmarks but that of robustness; write docs/measurements/benchmarks.md."""

from __future__ import annotations

from collections.abc import Callable
import sys
import time

import installations
import memory
import node_throughput
import options
import replay_speed
from report import machine, paragraphs, ROOT
import sizes
import speed
from timing import prepare

_DOCUMENT = ROOT / 'docs' / 'measurements' / 'benchmarks.md'

INTRODUCTION = paragraphs("""
    Written by `make bench`, which runs all of this side by side in one go, in less than ten
    minutes. The figures are of one machine; the ratios carry over. Robustness to noise is
    measured by `make robustness`: [robustness](robustness.md).
    """)

METHOD = paragraphs("""
    glibc's malloc returns large buffers to the kernel and fetches them anew, or does not,
    depending on what went before, and the same call takes up to three times as long. So the
    allocator is pinned with the variables above wherever steps are compared, and what is compared
    takes turns in one process.
    """)


def sections() -> dict[str, Callable[[], str]]:
    """Return what is measured, each with a word for who waits."""
    return {
        'step against peers': lambda: speed.section(*speed.measure()),
        'installations': installations.wheels_section,
        'padded sizes': sizes.section,
        'options': options.section,
        'memory': lambda: memory.section(memory.measure()),
        'node over DDS': lambda: node_throughput.section(*node_throughput.measure()),
        'replay': lambda: replay_speed.section(*replay_speed.measure()),
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
    _DOCUMENT.write_text('\n\n'.join(parts) + '\n', encoding='utf-8')
    print(f'written to {_DOCUMENT.relative_to(ROOT)}, after {time.monotonic() - began:.0f} s')


if __name__ == '__main__':
    main()
