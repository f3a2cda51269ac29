# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Phase correlation and its peers, behind one interface.

Each takes one greyscale frame after the other and returns the shift of the image since the
previous one, in pixels, positive to the right. The feature methods measure an angle. A yaw angle a
(positive to the left) moves the middle of the image by focal * tan(a), which they return, so that
all methods can be compared and coded by the same chain code.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import cv2
import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.correlation.spectrum import padded_shape
from phase_traj_ros.core.correlation.transforms import find_transform, OpenCvTransform
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.synthetic import Camera

_FEATURES = 1000
# Interval between the frames of all clips, in seconds.
_PERIOD_S = 0.1
_LEAST_MATCHES = 8
_CONFIDENCE, _RANSAC_PX = 0.999, 1.0


class Peer(Protocol):
    """A method that measures the motion of the image."""

    def update(self, frame: np.ndarray) -> float | None:
        """Return the shift since the previous frame in pixels; None without an answer."""


class Ours:
    """The phase correlation of this package."""

    def __init__(self) -> None:
        self._correlator = PhaseCorrelator()

    def update(self, frame: np.ndarray) -> float | None:
        """Return dx."""
        shift = self._correlator.update(frame)
        return None if shift is None else shift.dx


class Heading:
    """The heading of this package, given the focal length of the camera only."""

    def __init__(self, camera: Camera) -> None:
        self._focal = camera.focal
        self._estimator = VisualCompass(YawCamera(Lens(focal_px=camera.focal)))
        self._frames = 0

    def update(self, frame: np.ndarray) -> float | None:
        """Return the yaw in pixels; what was not measured is bridged."""
        measured = self._estimator.camera.measure(frame, _PERIOD_S)
        stamp_ns = round(self._frames * _PERIOD_S * 1e9)
        self._frames += 1
        if self._frames == 1:
            self._estimator.start(stamp_ns)
            return None
        yaw = self._estimator.add(measured, stamp_ns, _PERIOD_S).step.yaw
        return self._focal * math.tan(yaw)


class OpenCv:
    """``cv2.phaseCorrelate`` in float32 with its own window, converting each frame once."""

    def __init__(self) -> None:
        self._previous: np.ndarray | None = None
        self._window: np.ndarray | None = None

    def update(self, frame: np.ndarray) -> float | None:
        """Return dx."""
        previous, self._previous = self._previous, frame.astype(np.float32)
        if previous is None:
            self._window = cv2.createHanningWindow(frame.shape[::-1], cv2.CV_32F)
            return None
        (dx, _), _ = cv2.phaseCorrelate(previous, self._previous, self._window)
        return dx


class ScikitImage:
    """``skimage.registration.phase_cross_correlation``, to whole pixels, without a window."""

    def __init__(self, *, dtype: type | None = None) -> None:
        """Take frames as they are, or convert each to ``dtype`` once."""
        try:
            from skimage.registration import phase_cross_correlation
        except ImportError as error:
            raise MissingDependencyError(
                "scikit-image is one of the peers: pip install '.[bench]'") from error
        self._correlate = phase_cross_correlation
        self._dtype = dtype
        self._previous: np.ndarray | None = None

    def update(self, frame: np.ndarray) -> float | None:
        """Return dx; the function itself returns the shift that reverses the motion."""
        frame = frame if self._dtype is None else frame.astype(self._dtype)
        previous, self._previous = self._previous, frame
        if previous is None:
            return None
        return -float(self._correlate(previous, frame, upsample_factor=1)[0][1])


class Klt:
    """Corners of the previous frame, tracked into this one; rotation from the essential matrix."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._previous: np.ndarray | None = None

    def update(self, frame: np.ndarray) -> float | None:
        """Return focal * tan(yaw)."""
        previous, self._previous = self._previous, frame
        if previous is None:
            return None
        corners = cv2.goodFeaturesToTrack(previous, _FEATURES, 0.01, 8)
        if corners is None:
            return None
        tracked, found, _ = cv2.calcOpticalFlowPyrLK(previous, frame, corners, None)
        kept = found.ravel() == 1
        return _yaw_px(corners[kept].reshape(-1, 2), tracked[kept].reshape(-1, 2), self._camera)


class Orb:
    """ORB features matched between both frames; rotation from the essential matrix."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._detector = cv2.ORB_create(_FEATURES)  # type: ignore[attr-defined]
        self._matcher = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True)
        self._previous: tuple[Any, Any] | None = None

    def update(self, frame: np.ndarray) -> float | None:
        """Return focal * tan(yaw)."""
        current = self._detector.detectAndCompute(frame, None)
        previous, self._previous = self._previous, current
        if previous is None or previous[1] is None or current[1] is None:
            return None
        matches = self._matcher.match(previous[1], current[1])
        before = np.array([previous[0][match.queryIdx].pt for match in matches], np.float32)
        after = np.array([current[0][match.trainIdx].pt for match in matches], np.float32)
        return _yaw_px(before.reshape(-1, 2), after.reshape(-1, 2), self._camera)


class BareTransforms:
    """One forward and one inverse transform of the padded size of a frame, and nothing else."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self._frame = np.random.default_rng(0).normal(size=padded_shape(shape)).astype(np.float32)
        self.result = self._frame.copy()
        self._spectrum = np.empty_like(self._frame)
        self._transform = find_transform()

    def update(self, frame: np.ndarray) -> None:
        """Transform an array that is unrelated to ``frame`` forwards and back."""
        if isinstance(self._transform, OpenCvTransform):
            cv2.dft(self._frame, dst=self._spectrum)
            cv2.dft(self._spectrum, dst=self.result, flags=cv2.DFT_INVERSE)
        else:
            self._transform.forward(self.result, len(self.result))
            self._transform.inverse(self.result)

    def is_exact(self) -> bool:
        """Return whether the inverse transform has restored the array."""
        factor = self.result.size if isinstance(self._transform, OpenCvTransform) else 1
        return bool(np.allclose(self.result / factor, self._frame, atol=1e-4))


def _yaw_px(before: np.ndarray, after: np.ndarray, camera: Camera) -> float | None:
    if len(before) < _LEAST_MATCHES:
        return None
    matrix = camera.matrix()
    essential, inliers = cv2.findEssentialMat(
        before, after, matrix, cv2.RANSAC, _CONFIDENCE, _RANSAC_PX)
    if essential is None or essential.shape[0] < 3:
        return None
    _, rotation, _, _ = cv2.recoverPose(essential[:3], before, after, matrix, mask=inliers)
    # In image axes, a camera that turns left sees what was ahead (0, 0, 1) to its right.
    sine, cosine = rotation[0, 2], rotation[2, 2]
    return float(camera.focal * sine / cosine) if cosine > 0 else None
