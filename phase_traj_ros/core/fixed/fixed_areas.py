# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Finds the parts of the image that are fixed to the camera while the world moves.

Black bars, the bonnet, burnt-in text and drops on the windscreen do not move, and a correlation
of the whole image may lock on to them. They are found in the mean of the image gradients: those of
the moving scene average out, those of a fixed pattern remain.

Three rules prevent false detections. First, a gradient counts only as far as the image around it
changes, so a stationary vehicle and the far distance give no evidence. Second, the weaker
eigenvalue of the matrix of mean gradients counts, because edges parallel to the motion (a kerb, a
lane marking) remain, too. Third, areas that move again are released.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.fixed.picture_samples import PictureSamples, Plane
from phase_traj_ros.core.fixed.tuning import TUNING


class FixedAreas:
    """
    Learns which parts of the images of one camera are fixed to it.

    Starts without knowledge and needs some seconds of driving. Learned areas fade as quickly.
    """

    def __init__(self) -> None:
        """Make a detector that has seen no frame."""
        self._allocate((1, 1))

    def interrupt(self) -> None:
        """Do not compare the next frame with earlier ones; learned areas are kept."""
        self._samples.interrupt()
        self._reference: Plane | None = None
        self._age = 0.0
        # Share of the gradients that changed up to the newest sample; fixed areas do not count.
        self._changing_share, self._mostly_unchanged = 0.0, False
        self.moving = False
        """Whether the change, that by noise included, is large and in all parts of the image: the
        world may move."""
        self.only_horizon_unchanged = False
        """Whether only the horizon is unchanged and the road below it changes: the vehicle drives
        straight on, however little of the image moves."""

    @property
    def sufficient(self) -> bool:
        """
        Return whether enough of the image remains to measure a shift.

        Bars leave a smaller but complete image; drops leave an image with gaps.
        """
        needed = TUNING.min_usable_share * (1.0 - self._black_share)
        return self._usable_share >= max(needed, TUNING.min_usable_image)

    @property
    def blank(self) -> bool:
        """Return whether the newest sample holds only sensor noise, as in the dark."""
        return self._samples.blank

    def doubts(self, shift: Shift, *, agreed: bool) -> bool:
        """
        Return whether the newest shift is not evidence of driving straight ahead.

        True if the shift is zero and only fixed areas can agree with it: a part of the image
        changes, and most of it has not changed for long or the blocks have not ``agreed`` with the
        shift; and not only the horizon is unchanged.
        """
        if abs(shift.dx) > TUNING.zero_px or self.only_horizon_unchanged:
            return False
        return self._mostly_unchanged or (
            self._changing_share >= TUNING.standing_share and not agreed)

    def weights(self) -> NDArray[np.uint8] | None:
        """
        Return the weight of each pixel of a frame, (H, W) uint8: 0 where fixed, 255 elsewhere.

        None if nothing is fixed. The correlator and the yaw meter accept it as a mask.
        """
        if self.share == 0.0:
            return None
        return self._samples.enlarged(255 - 255 * self._fixed, self._shape)

    def update(self, frame: Frame, interval: float, *, turned: float = 0.0) -> bool:
        """
        Take the next frame, (H, W) of any type; return whether ``weights`` has changed.

        A frame of another size restarts the learning. ``interval`` is the time since the previous
        frame in seconds, 0 for the first, and ``turned`` the shift in pixels, 0 if not known.
        """
        if frame.shape != self._shape:
            self._allocate(frame.shape)
        if not self._samples.take(frame, interval, turned) or not self._learn():
            return False
        self._learned += 1
        return self._learned % TUNING.update_samples == 0 and self._renew()

    def _allocate(self, shape: tuple[int, int]) -> None:
        """Start again for frames of this shape."""
        self._shape = shape
        self._samples = PictureSamples(shape)
        reduced = self._samples.shape
        self._near = 2 * max(round(TUNING.neighbourhood_share * self._samples.diagonal), 1) + 1
        self._learned = 0
        # Means of the gradients to the right and downwards, of their energy, and the evidence.
        self._means: Plane = np.zeros((4, *reduced), np.float32)
        self._darkest = np.full(reduced, np.inf, np.float32)
        self._brightest = np.full(reduced, -np.inf, np.float32)
        # 1 where fixed, and the share of each cell that is not.
        self._fixed: NDArray[np.uint8] = np.zeros(reduced, np.uint8)
        self._open_share = self._samples.cell_means(np.ones(reduced, np.float32))
        self.share = 0.0
        """Share of the image that is fixed, 0 to 1."""
        self._usable_share, self._black_share = 1.0, 0.0
        self.interrupt()

    def _learn(self) -> bool:
        """Add the newest sample to the means if the world moves; return whether it does."""
        changed, energy, noise = self._samples.changes()
        self.moving = self._moves(changed, energy)
        # Without the noise: either may be a little below 0.
        changed, energy = changed - noise, energy - noise
        self._changing_share = self._share(changed, energy)
        self._check_long_term()
        if not self._moves(changed, energy):
            return False
        moved = np.full_like(changed, TUNING.full_change)
        if self._samples.turned <= TUNING.full_shift_px:
            about = (2 * TUNING.change_radius_cells + 1, 2 * TUNING.change_radius_cells + 1)
            moved = np.divide(cv2.blur(changed, about), np.maximum(cv2.blur(energy, about), 1e-6))
        full = TUNING.full_change - TUNING.min_change
        moved = np.clip((moved - TUNING.min_change) / full, 0.0, 1.0)
        height, width = self._samples.shape
        counts = cv2.resize(
            TUNING.sample_weight * moved, (width, height), interpolation=cv2.INTER_LINEAR)
        self._means[:3] += counts * (self._samples.gradients[:3] - self._means[:3])
        self._means[3] += counts * (1.0 - self._means[3])
        picture = self._samples.picture
        np.minimum(self._darkest + TUNING.forgetting_levels, picture, out=self._darkest)
        np.maximum(self._brightest - TUNING.forgetting_levels, picture, out=self._brightest)
        return True

    def _check_long_term(self) -> None:
        """Check whether only a part of the image has changed for long."""
        if self._reference is not None:
            changed, energy, noise = self._samples.changes(self._reference)
            share = self._share(changed, energy)
            self.only_horizon_unchanged = self._only_horizon_remains(self._reference)
            self._age += self._samples.elapsed
            if share < TUNING.driving_share and self._age < TUNING.standing_window_s:
                return
            # A change before the vehicle stopped does not count.
            still_changes = self._changing_share * TUNING.standing_window_s >= (
                TUNING.standing_share * self._samples.elapsed)
            # Fine texture may look like noise: what may have changed by noise is not unchanged.
            self._mostly_unchanged = still_changes and share < TUNING.driving_share and (
                self._share(changed - noise, energy - noise) >= TUNING.standing_share)
        self._reference, self._age = self._samples.gradients, 0.0

    def _only_horizon_remains(self, since: Plane) -> bool:
        # Edges do not count: along a straight road, lane markings do not move either.
        structure, remaining = (
            (self._open_share * self._corners(since, gradients)).sum(axis=1)
            for gradients in (since, self._samples.gradients))
        rows = len(structure)
        road = round((1.0 - TUNING.road_share) * rows)
        if remaining[road:].sum() >= TUNING.road_unchanged_share * structure[road:].sum():
            return False
        far = remaining[:road]
        band = np.convolve(far, np.ones(max(rows // TUNING.bands, 1)))
        return bool(far.sum() > TUNING.far_unchanged_share * structure[:road].sum()
                    and band.max() > TUNING.band_share * far.sum())

    def _corners(self, first: Plane, second: Plane) -> Plane:
        """Return the structure in two directions that both gradients have, by cells."""
        xx, yy, xy = (self._samples.cell_means(product) for product in (
            first[0] * second[0], first[1] * second[1],
            first[0] * second[1] + first[1] * second[0]))
        return np.maximum(xx + yy - np.hypot(xx - yy, xy), 0.0)  # type: ignore[no-any-return]

    def _moves(self, changed: Plane, energy: Plane) -> bool:
        """Return whether the world moves, and not only traffic in a part of the image."""
        changes, energies = (
            np.array([strip.sum() for strip in np.array_split(
                self._open_share * amount, TUNING.strips)]) for amount in (changed, energy))
        stays = (energies > TUNING.min_strip_share * energies.sum()) & (
            changes < TUNING.strip_change_share * energies)
        return self._share(changed, energy) >= TUNING.moving_share and bool(
            np.count_nonzero(stays) <= 1)

    def _share(self, changed: Plane, energy: Plane) -> float:
        """Return the share of the energy that changed, 0 to 1, without the fixed areas."""
        total = float((self._open_share * energy).sum())
        if total <= 0.0:
            return 0.0
        return min(max(float((self._open_share * changed).sum()) / total, 0.0), 1.0)

    def _renew(self) -> bool:
        """Find the areas again; return whether they have changed."""
        black = self._bars()
        fixed = (self._patterns() | black).astype(np.uint8)
        # A pattern extends beyond its gradients, and the middle of a drop has none.
        square = np.ones((3, 3), np.uint8)
        closed = cv2.morphologyEx(fixed, cv2.MORPH_CLOSE, square)
        fixed = np.asarray(cv2.dilate(closed, square), np.uint8)
        if np.count_nonzero(fixed != self._fixed) <= TUNING.update_share * fixed.size:
            return False
        self._fixed = fixed
        self._open_share = 1.0 - self._samples.cell_means(fixed.astype(np.float32))
        self.share = np.count_nonzero(fixed) / fixed.size
        self._black_share = np.count_nonzero(black) / black.size
        # A narrow strip between two fixed areas is not usable.
        self._usable_share = 1.0 - np.count_nonzero(cv2.dilate(fixed, square)) / fixed.size
        return True

    def _patterns(self) -> NDArray[np.bool_]:
        """Return where patterns remain, (h, w)."""
        across, down, energy, known = self._means
        near = (self._near, self._near)
        xx, yy, xy = (cv2.blur(product, near) for product in (
            across * across, down * down, across * down))
        weaker = xx + yy - np.sqrt(np.square(xx - yy) + 4.0 * np.square(xy))
        remaining = weaker / (cv2.blur(energy * known, near) + 1e-4)
        least = TUNING.min_evidence
        limit = TUNING.fixed_energy_share + TUNING.evidence_penalty / np.maximum(known, least)
        return np.asarray((known > least) & (remaining > limit))

    def _bars(self) -> NDArray[np.bool_]:
        """Return the areas that touch the border and have always been black, (h, w)."""
        black = ((self._brightest < TUNING.dark_levels) & (
            self._brightest - self._darkest < TUNING.constant_levels)).astype(np.uint8)
        framed = cv2.copyMakeBorder(black, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(1,))
        cv2.floodFill(framed, None, (0, 0), (255,))
        return np.asarray(framed[1:-1, 1:-1] == 255)
