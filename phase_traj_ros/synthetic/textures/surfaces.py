# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Textures of all but the fronts of houses: leaves, roofs, garden walls, bark, cars."""

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import Singles
from phase_traj_ros.synthetic.textures.noise import Sheet


def foliage(sheet: Sheet) -> Singles:
    """Return leaves: dark gaps, lit clumps, a bright speckle."""
    light: Singles = 0.55 * sheet.noise(1.0) + 0.6 * sheet.noise(0.5)
    values = sheet.rng.uniform(35, 70) + 38.0 * light
    values += 45.0 * np.clip(light - 0.8, 0.0, 2.0)
    return values


def roof(sheet: Sheet) -> Singles:
    """Return courses of tiles, perhaps with skylights, and the gutter below."""
    (rng, density) = (sheet.rng, sheet.density)
    course = round(rng.uniform(0.14, 0.24) * density)
    values = np.full(sheet.shape, rng.uniform(45, 110), np.float32)
    values *= 1.0 + 0.12 * sheet.noise(0.5)
    values *= 1.0 + 0.1 * sheet.noise(1.0)
    values[::course] *= 0.55
    for _ in range(int(rng.integers(0, 3))):
        (x, z) = (rng.uniform(0, sheet.length - 1.0), rng.uniform(0.4, sheet.height - 1.2))
        box = [round(value * density) for value in (x, z, 0.8, 1.0)]
        values[box[1]:box[1] + box[3], box[0]:box[0] + box[2]] = rng.uniform(20, 240)
    values[-round(0.12 * density):] = rng.uniform(120, 220)
    return values


def masonry(sheet: Sheet) -> Singles:
    """Return a garden wall of rough stones."""
    (rng, density, columns) = (sheet.rng, sheet.density, sheet.shape[1])
    values = np.full(sheet.shape, rng.uniform(70, 180), np.float32)
    # Not used, but drawn: the textures after it stay as they are.
    rng.random()
    z = 0.0
    while z < sheet.height:
        step = rng.uniform(0.15, 0.4)
        (top, bottom) = (round(z * density), round((z + step) * density))
        edges = np.cumsum(rng.uniform(0.2, 0.7, 120)) * density
        stone = np.searchsorted(edges, np.arange(columns))
        values[top:bottom] *= rng.normal(1.0, 0.16, 121).astype(np.float32)[stone]
        values[top:top + 1] *= 0.5
        values[top:bottom, np.round(edges[edges < columns - 1]).astype(int)] *= 0.5
        z += step
    values *= 1.0 + 0.12 * sheet.noise(0.5)
    values[:round(0.08 * density)] = rng.uniform(90, 220)
    return values


def bark(sheet: Sheet) -> Singles:
    """Return bark with vertical furrows."""
    furrows = sheet.noise(0.5, down=8)
    values = sheet.rng.uniform(40, 90) * (1.0 + 0.3 * furrows)
    return values + 8.0 * sheet.noise(0.5)


def _paintwork(sheet: Sheet) -> tuple[Singles, float]:
    """Return the body of a car, lighter at the top, which reflects the sky, and its tone."""
    rng = sheet.rng
    tone = float(rng.choice([rng.uniform(15, 60), rng.uniform(90, 160), rng.uniform(190, 235)]))
    sheen = np.linspace(1.3, 0.6, sheet.shape[0], dtype=np.float32)[:, None]
    mirrored = sheet.noise(1.0, across=10)
    return (np.float32(tone) * sheen + np.float32(9.0) * mirrored, tone)


def car_side(sheet: Sheet) -> Singles:
    """Return the side of a car: body, side windows, wheels, lines of the doors."""
    (rng, (rows, columns)) = (sheet.rng, sheet.shape)
    (values, tone) = _paintwork(sheet)

    def place(x: float, z: float) -> tuple[int, int]:
        return (round(x * columns), round((1.0 - z) * rows))

    glass = np.array([place(x, z) for (x, z) in (
        (0.2, 0.6), (0.3, 0.93), (0.75, 0.93), (0.9, 0.6))])
    cv2.fillPoly(values, [glass], rng.uniform(15, 45))
    for x in rng.uniform((0.3, 0.52, 0.7), (0.4, 0.58, 0.78)):
        cv2.line(values, place(x, 0.95), place(x, 0.15), 0.55 * tone, 1)
        cv2.line(values, place(x, 0.95), place(x, 0.6), tone, round(0.05 * sheet.density))
    cv2.line(values, place(0.02, 0.42), place(0.98, 0.45), 0.6 * tone, 2)
    values[-round(0.16 * rows):] = 18.0
    for x in (rng.uniform(0.17, 0.2), rng.uniform(0.79, 0.82)):
        radius = round(0.31 * sheet.density)
        center = (round(x * columns), rows - radius)
        cv2.circle(values, center, round(1.2 * radius), 10.0, -1)
        cv2.circle(values, center, radius, 28.0, -1)
        cv2.circle(values, center, round(0.65 * radius), rng.uniform(100, 190), -1)
        for angle in np.arange(5) * 1.2566 + rng.uniform(0, 1.2):
            rim = (round(center[0] + 0.6 * radius * np.cos(angle)),
                   round(center[1] + 0.6 * radius * np.sin(angle)))
            cv2.line(values, center, rim, 40.0, 2)
    return values + 3.0 * sheet.noise(0.5)


def car_end(sheet: Sheet) -> Singles:
    """Return the front or the rear of a car: window, lamps, number plate, bumper."""
    (rng, (rows, columns)) = (sheet.rng, sheet.shape)
    (values, tone) = _paintwork(sheet)

    def box(left: float, low: float, right: float, high: float, value: float) -> None:
        values[round((1 - high) * rows):round((1 - low) * rows),
               round(left * columns):round(right * columns)] = value

    box(0.14, 0.6, 0.86, 0.94, rng.uniform(15, 50))
    box(0.3, 0.66, 0.6, 0.85, rng.uniform(40, 110))
    for left in (0.03, 0.8):
        box(left, 0.44, left + 0.17, 0.58, rng.uniform(60, 240))
    box(0.34, 0.36, 0.66, 0.45, 225.0)
    for left in np.arange(0.37, 0.62, 0.05) + rng.uniform(0, 0.015):
        box(float(left), 0.375, float(left) + 0.025, 0.435, 30.0)
    box(0.0, 0.2, 1.0, 0.26, 0.5 * tone)
    box(0.0, 0.0, 1.0, 0.13, 15.0)
    for left in (0.04, 0.82):
        box(left, 0.0, left + 0.14, 0.2, 22.0)
    return values + 3.0 * sheet.noise(0.5)
