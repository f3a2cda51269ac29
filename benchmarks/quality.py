# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the tests of quality were chosen: what tells a measurement, standing still, a fixed pattern.

Every candidate is tried on the same pairs of frames. Takes some ten minutes; writes
docs/quality.md and the curves in docs/images.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import sys

from clips import Clip
from conditions import CONDITIONS
import cv2
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, Shift
from phase_traj_ros.core.block_motion import BlockMotion
from phase_traj_ros.core.quality import (
    GateSettings,
    MeasurementGate,
    StillnessDetector,
    StillnessSettings,
)
from quality_data import (
    blind,
    creeping,
    cropped,
    driving,
    named,
    overlays,
    standing,
    Stretch,
    windows,
)
from report import paragraphs, ROOT, table, versions
