# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Fourier transforms, and the choice of the library that computes them.

OpenCV's own transforms take four times as long as Intel's, which its wheels for x86_64 contain;
scipy's are in between. docs/explanation/transforms.md gives the measurements and the reasons. All
of them work in place on the packed layout of ``phase_traj_ros.core.correlation.spectrum``, so
no other module depends on the library.
"""

from contextlib import suppress
from functools import cache
import importlib
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.errors import MissingDependencyError, needing


class OpenCvTransform:
    """``cv2.dft``, whose spectra are packed already."""

    @property
    def name(self) -> str:
        """Return the version of OpenCV, and whether it contains Intel's transforms."""
        return f'OpenCV {cv2.__version__} ({"Intel IPP" if opencv_has_intels() else "its own"})'

    def forward(self, picture: NDArray[np.float32], rows: int) -> None:  # noqa: ARG002
        """
        Replace ``picture``, whose rows from ``rows`` on are 0, by its spectrum.

        All rows are transformed: given their number, OpenCV does not call Intel's library.
        """
        cv2.dft(picture, dst=picture)

    def inverse(self, spectrum: NDArray[np.float32]) -> float:
        """
        Replace ``spectrum`` by its image times a factor; return the factor.

        The division by the size is left to the caller, to save time.
        """
        cv2.dft(spectrum, dst=spectrum, flags=cv2.DFT_INVERSE)
        return float(spectrum.size)


class ScipyTransform:
    """
    pocketfft, part of scipy, with the interface of ``OpenCvTransform``.

    ``scipy.fftpack`` packs a real line like OpenCV and works in place; ``scipy.fft`` allocates.
    """

    def __init__(self) -> None:
        """
        Import scipy.

        Raises
        ------
        MissingDependencyError
            scipy is not installed.

        """
        with needing('scipy is not installed', 'install python3-scipy (apt) or scipy (pip)'):
            self.name = f'scipy {importlib.import_module("scipy").__version__}'
            """Version of scipy."""
            self._complex: Any = importlib.import_module('scipy.fft')
            self._real: Any = importlib.import_module('scipy.fftpack')

    def forward(self, picture: NDArray[np.float32], rows: int) -> None:
        """Transform the rows that are not empty, then all columns."""
        self._real.rfft(picture[:rows], axis=1, overwrite_x=True)
        self._real.rfft(_ends(picture), axis=0, overwrite_x=True)
        self._complex.fft(_pairs(picture), axis=0, overwrite_x=True)

    def inverse(self, spectrum: NDArray[np.float32]) -> float:
        """Transform all columns, then all rows."""
        self._complex.ifft(_pairs(spectrum), axis=0, overwrite_x=True)
        self._real.irfft(_ends(spectrum), axis=0, overwrite_x=True)
        self._real.irfft(spectrum, axis=1, overwrite_x=True)
        return 1.0


Transform = OpenCvTransform | ScipyTransform
"""The two transforms of a real array (M, N) float32, both sides even, in place."""


def _pairs(packed: NDArray[np.float32]) -> NDArray[np.complex64]:
    """Return the bins of the columns' frequencies 1 to N/2-1, (M, N/2-1)."""
    return packed[:, 1:-1].view(np.complex64)


def _ends(packed: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the first and the last column, which hold the frequencies 0 and N/2, (M, 2)."""
    return packed[:, ::packed.shape[1] - 1]


def opencv_has_intels() -> bool:
    """
    Return whether OpenCV was built with Intel's library.

    It may be disabled at run time. That is ignored, because the choice must not depend on it.
    """
    return hasattr(cv2, 'ipp') and cv2.ipp.getIppVersion() != 'disabled'


def transform_hint() -> str:
    """Return how to make the transforms faster; empty if no faster choice is known."""
    if opencv_has_intels() or isinstance(find_transform(), ScipyTransform):
        return ''
    return ('scipy is twice as fast as this OpenCV: install python3-scipy (apt) or scipy'
            ' (pip)')


@cache
def find_transform() -> Transform:
    """
    Return the fastest transforms.

    They depend only on what is installed, so one installation always gives the same shifts.
    """
    if not opencv_has_intels():
        with suppress(MissingDependencyError):
            return ScipyTransform()
    return OpenCvTransform()
