# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The colours of figures, animations, debug pictures and HTML pages."""

from dataclasses import asdict, dataclass
from typing import Final, TypeAlias

Rgb: TypeAlias = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """Colours by what they are for, each as #rrggbb."""

    paper: str
    card: str
    """Of the boxes that lie on the paper."""
    ink: str
    faint: str
    """Of texts that are beside the point."""
    muted: str
    """Of grids, and of the truth beneath what is drawn."""
    rule: str
    line: str
    """Of paths and curves."""
    tint: str
    """Of the parts of them that are still to come."""
    accent: str
    """Of thresholds and ends."""
    band: str
    """Of stretches in the background of a curve, with the share that covers as #rrggbbaa."""
    left: str
    forward: str
    right: str
    rest: str
    """Of no change."""
    backward: str
    warn: str

    def css(self) -> str:
        """Return the colours as custom properties of CSS."""
        return ' '.join(f'--{name}: {colour};' for name, colour in asdict(self).items())


LIGHT: Final = Palette(
    paper='#f4f6f8', card='#ffffff', ink='#1f2933', faint='#65717e', muted='#9aa5b1',
    rule='#dfe4ea', line='#0b6e99', tint='#c8dee8', accent='#d1495b', band='#0b6e991a',
    left='#3a7ca5', forward='#b8c4ce', right='#e08e45', rest='#e6ebf0', backward='#8d6a9f',
    warn='#b4541a')
"""On paper; pictures have the colour of a card as their ground."""

DARK: Final = Palette(
    paper='#14191f', card='#1d242c', ink='#e4e9ee', faint='#93a0ad', muted='#6b7682',
    rule='#323c47', line='#5fb4dc', tint='#24516a', accent='#ef7a8a', band='#5fb4dc21',
    left='#5fa3cf', forward='#57636f', right='#e59f5f', rest='#2b343e', backward='#a884ba',
    warn='#f0a36b')
"""On a dark ground, and on the camera's frames."""


def rgb(colour: str) -> Rgb:
    """Return a colour #rrggbb as red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def bgr(colour: str) -> Rgb:
    """Return a colour #rrggbb in OpenCV's order: blue, green and red."""
    red, green, blue = rgb(colour)
    return blue, green, red
