# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The colours of figures, debug images and HTML pages."""

from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """
    Colours by purpose, each as #rrggbb.

    ``paper`` is the background of a page and ``card`` that of its boxes, ``ink`` is text and
    ``faint`` text of minor importance, ``muted`` are grids and the true path below the drawn one,
    ``rule`` are borders, ``line`` are paths and curves, ``accent`` thresholds and ends, ``band``
    (as #rrggbbaa) spans in the background of a curve, ``rest`` is the movement *no change*.
    """

    paper: str
    card: str
    ink: str
    faint: str
    muted: str
    rule: str
    line: str
    accent: str
    band: str
    left: str
    forward: str
    right: str
    rest: str
    backward: str
    warn: str

    def css(self) -> str:
        """Return the colours as CSS custom properties."""
        return ' '.join(f'--{name}: {colour};' for name, colour in asdict(self).items())


LIGHT = Palette(
    paper='#f4f6f8', card='#ffffff', ink='#1f2933', faint='#65717e', muted='#9aa5b1',
    rule='#dfe4ea', line='#0b6e99', accent='#d1495b', band='#0b6e991a',
    left='#3a7ca5', forward='#b8c4ce', right='#e08e45', rest='#e6ebf0', backward='#8d6a9f',
    warn='#b4541a')
"""For paper. Figures have the colour of a card as background."""

DARK = Palette(
    paper='#14191f', card='#1d242c', ink='#e4e9ee', faint='#93a0ad', muted='#6b7682',
    rule='#323c47', line='#5fb4dc', accent='#ef7a8a', band='#5fb4dc21',
    left='#5fa3cf', forward='#57636f', right='#e59f5f', rest='#2b343e', backward='#a884ba',
    warn='#f0a36b')
"""For dark backgrounds and camera images."""


def bgr(colour: str) -> tuple[int, int, int]:
    """Return a colour #rrggbb in OpenCV's order: blue, green and red, 0 to 255."""
    red, green, blue = bytes.fromhex(colour[1:])
    return blue, green, red
