# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which parts of the picture stay where they are while the world moves.

Black bars, the bonnet, burnt-in text and drops on the windscreen hold still, and a correlation of
the whole picture finds them rather than the street. They show in the mean of the picture's
gradients: those of the world average out as it passes by, those of a fixed pattern remain.

Three things keep the world from being taken for a fixed pattern. Evidence counts in so far as the
picture changes round about, so a vehicle that stands, and what is far away straight ahead, give
none. A pattern has to be fixed in both directions, as an edge that is parallel to the motion (a
kerb, a lane marking) remains, too: the weaker eigenvalue of the mean gradients' matrix is what
counts. And what moves again is forgotten.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.correlation.picture_samples import PictureSamples

# What a sample adds to the means at most, and every how many samples areas are found anew.
_SHARE = 0.06
_RENEWED = 4
# Share of the gradients that has to change for the world to be moving.
_MOVING = 0.25
# So much of it in each strip of rows that has a share of all gradients, but one, which may be the
# bonnet: traffic fills a few.
_STRIPS, _TELLING, _EVERYWHERE = 4, 0.1, 0.1
# Round about a place: from where on its gradients begin to count, and where they count fully.
_LEAST_CHANGE, _FULL_CHANGE = 0.2, 0.6
# Where the picture has turned so far from sample to sample, in reduced pixels, all of it counts.
_TURNED = 4.0
# A shift no further than this from zero, in pixels, may be that of a fixed pattern.
_AT_ZERO = 0.75
# Within so many seconds, driving changes more of the picture than the second share, however slow,
# and standing less than the first.
_LONG = 2.0
_STANDING, _DRIVING = 0.1, 0.5
# How far that is, in places.
_ABOUT = 2
# What is fixed has a share of the gradients' energy above this, the more so the less is known.
_FIXED, _DOUBT, _LEAST_KNOWN = 0.1, 0.08, 0.3
# Half a side of the square in which gradients are compared, as a share of the diagonal.
_NEAR = 0.012
# Bars are darker than this, and vary by less, on the scale of the brightness above.
_DARK, _CONSTANT, _RELAXING = 25.0, 8.0, 0.03
# Areas that differ in a smaller share of the picture than this are left as they are.
_SAME = 0.005
# Share of what is not black that has to be left, and of the whole picture.
_LEAST_LEFT, _LEAST_SEEN = 0.5, 0.1


class FixedAreas:
    """
    Learns which parts of the pictures of one camera are fixed to it.

    Nothing is known at the start; some seconds of driving tell. What is learned fades as fast.
    """

    def __init__(self) -> None:
        """Make one that has seen nothing."""
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next frame may be of another camera."""
        self._shape: tuple[int, int] | None = None
        self._lay_out((1, 1))

    def interrupt(self) -> None:
        """Do not compare the next frame with those before; what is learned stays."""
        self._samples.interrupt()
        self._reference: NDArray[np.float32] | None = None
        self._age = 0.0
        self._changing, self._moving, self._held = 0.0, False, False

    @property
    def share(self) -> float:
        """Return the share of the picture that is fixed, 0 to 1."""
        return self._share

    @property
    def sufficient(self) -> bool:
        """
        Return whether enough is left of the picture to measure anything.

        Bars leave a smaller picture, which is as good as any; drops leave gaps.
        """
        return self._left >= max(_LEAST_LEFT * (1.0 - self._black), _LEAST_SEEN)

    @property
    def changing(self) -> float:
        """
        Return which share of the picture's gradients, 0 to 1, changed up to the newest sample.

        What is fixed does not count. Of a vehicle that stands it is near 0 by day; some tenths of
        a second of driving change more than half.
        """
        return self._changing

    @property
    def moving(self) -> bool:
        """Return whether it is so much, in all parts of the picture, that the world moves."""
        return self._moving

    @property
    def blank(self) -> bool:
        """Return whether the newest sample shows nothing but the sensor's noise, as by night."""
        return self._samples.blank

    def doubts(self, shift: Shift, *, agreed: bool = True) -> bool:
        """
        Return whether the newest shift is no evidence of driving straight on.

        It is not where it is zero and only what is fixed can agree with it: part of the picture
        changes, and most of it does not for long, or the blocks do not agree with each other.

        Parameters
        ----------
        shift
            Of the newest pair of frames.
        agreed
            Whether the parts of the picture agree with it, where they were asked.

        """
        if abs(shift.dx) > _AT_ZERO:
            return False
        return self._held or (self._changing >= _STANDING and not agreed)

    def weights(self) -> NDArray[np.uint8] | None:
        """
        Return how much each pixel of a frame counts, (H, W): 0 where it is fixed, 255 elsewhere.

        None if nothing is fixed. This is a mask as the correlator and the yaw meter take it.
        """
        if self._shape is None or self._share == 0.0:
            return None
        height, width = self._shape
        weights = cv2.resize(
            255 - self._fixed, (width, height), interpolation=cv2.INTER_NEAREST)
        return weights  # type: ignore[return-value]

    def update(self, frame: Frame, interval: float, *, turned: float = 0.0) -> bool:
        """
        Take the next frame; return whether ``weights`` have changed.

        Parameters
        ----------
        frame
            (H, W) uint8, uint16 or float32. A frame of another size starts anew.
        interval
            Seconds since the frame before it, 0 for the first.
        turned
            Shift of the picture since then in pixels, positive to the right, where it is known.

        """
        if frame.shape != self._shape:
            self._lay_out(frame.shape)
            self._shape = frame.shape
        if not self._samples.take(frame, interval, turned) or not self._learn():
            return False
        self._learned += 1
        return self._learned % _RENEWED == 0 and self._renew()

    def _lay_out(self, shape: tuple[int, int]) -> None:
        """Start anew for frames of this shape."""
        self._samples = PictureSamples(shape)
        reduced = self._samples.shape
        self._near = 2 * max(round(_NEAR * self._samples.diagonal), 1) + 1
        self._learned = 0
        # The means of the gradients to the right and downwards, of their energy, and of 1: how
        # much is known.
        self._means: NDArray[np.float32] = np.zeros((4, *reduced), np.float32)
        self._darkest = np.full(reduced, np.inf, np.float32)
        self._brightest = np.full(reduced, -np.inf, np.float32)
        self._fixed: NDArray[np.uint8] = np.zeros(reduced, np.uint8)
        self._share, self._left, self._black = 0.0, 1.0, 0.0
        self.interrupt()

    def _learn(self) -> bool:
        """Take the newest sample into the means, if the world moves; return whether it does."""
        changed, energy = self._samples.changes()
        closed = self._samples.by_places(self._fixed.astype(np.float32)) / np.float32(255)
        self._watch(closed)
        if not self._moves(changed - changed * closed, energy - energy * closed):
            return False
        moved = np.full_like(changed, _FULL_CHANGE)
        if self._samples.turned <= _TURNED:
            about = (2 * _ABOUT + 1, 2 * _ABOUT + 1)
            moved = np.divide(cv2.blur(changed, about), cv2.blur(energy, about) + 1e-6)
        moved = np.clip((moved - _LEAST_CHANGE) / (_FULL_CHANGE - _LEAST_CHANGE), 0.0, 1.0)
        height, width = self._samples.shape
        counts = cv2.resize(_SHARE * moved, (width, height), interpolation=cv2.INTER_LINEAR)
        self._means[:3] += counts * (self._samples.gradients - self._means[:3])
        self._means[3] += counts * (1.0 - self._means[3])
        picture = self._samples.picture
        np.minimum(self._darkest + _RELAXING, picture, out=self._darkest)
        np.maximum(self._brightest - _RELAXING, picture, out=self._brightest)
        return True

    def _watch(self, closed: NDArray[np.float32]) -> None:
        """Look whether most of the picture has held still for long while some of it has not."""
        if self._reference is not None:
            changed, energy = self._samples.changes(self._reference)
            total = float((energy - energy * closed).sum())
            share = float((changed - changed * closed).sum()) / total if total > 0.0 else 0.0
            self._age += self._samples.elapsed
            if share < _DRIVING and self._age < _LONG:
                return
            self._held = _STANDING <= share < _DRIVING
        self._reference, self._age = self._samples.gradients.copy(), 0.0

    def _moves(self, changed: NDArray[np.float32], energy: NDArray[np.float32]) -> bool:
        """Return whether it is the world that moves, and not what passes by in a part of it."""
        total = float(energy.sum())
        self._changing = min(float(changed.sum()) / total, 1.0) if total > 0.0 else 0.0
        rows = np.array_split(np.stack([changed.sum(axis=1), energy.sum(axis=1)]), _STRIPS, axis=1)
        strips = np.array([strip.sum(axis=1) for strip in rows])
        telling = strips[:, 1] > _TELLING * total
        self._moving = self._changing >= _MOVING and bool(
            np.count_nonzero(strips[telling, 0] < _EVERYWHERE * strips[telling, 1]) <= 1)
        return self._moving

    def _renew(self) -> bool:
        """Find the areas anew; return whether they are others than before."""
        black = self._bars()
        fixed = self._patterns() | black
        # A pattern ends beyond its gradients, and the middle of a drop has none.
        square = np.ones((3, 3), np.uint8)
        closed = cv2.morphologyEx(fixed, cv2.MORPH_CLOSE, square)
        fixed = np.asarray(cv2.dilate(closed, square), np.uint8)
        if np.count_nonzero(fixed != self._fixed) <= _SAME * fixed.size:
            return False
        self._fixed = fixed
        self._share = np.count_nonzero(fixed) / fixed.size
        self._black = np.count_nonzero(black) / black.size
        # What is left between two areas that nearly touch does not tell anything.
        self._left = 1.0 - np.count_nonzero(cv2.dilate(fixed, square)) / fixed.size
        return True

    def _remaining(self) -> NDArray[np.float32]:
        """Return the share of the gradients' energy that remains, in the weaker direction."""
        across, down, energy, known = self._means
        near = (self._near, self._near)
        xx, yy, xy = (cv2.blur(product, near) for product in (
            across * across, down * down, across * down))
        weaker = xx + yy - np.sqrt(np.square(xx - yy) + 4.0 * np.square(xy))
        remaining: NDArray[np.float32] = weaker / (cv2.blur(energy * known, near) + 1e-4)
        return remaining

    def _patterns(self) -> NDArray[np.uint8]:
        """Return where there are patterns that remain, 255 or 0."""
        known = self._means[3]
        limit = _FIXED + _DOUBT / np.maximum(known, _LEAST_KNOWN)
        found = (known > _LEAST_KNOWN) & (self._remaining() > limit)
        return np.where(found, np.uint8(255), np.uint8(0))

    def _bars(self) -> NDArray[np.uint8]:
        """Return what reaches the edge of the picture and has always been black, 255 or 0."""
        black = ((self._brightest < _DARK) & (
            self._brightest - self._darkest < _CONSTANT)).astype(np.uint8)
        framed = cv2.copyMakeBorder(black, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(1,))
        cv2.floodFill(framed, None, (0, 0), (255,))
        return np.where(framed[1:-1, 1:-1] == 255, np.uint8(255), np.uint8(0))
