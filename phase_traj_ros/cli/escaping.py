# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Escapes control characters in what is printed: a terminal would execute them."""

from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
import io
import sys
from typing import TextIO


def escaped(text: str, *, kept: str = '') -> str:
    """Return a text with its control characters, except the ``kept`` ones, as in Python."""
    if text.isprintable():
        return text
    return ''.join(
        sign if sign.isprintable() or sign in kept
        else sign.encode('unicode_escape').decode() for sign in text)


class Escaping(io.TextIOBase):
    """Escapes what is written to another stream; keeps line breaks and tabulators."""

    def __init__(self, stream: TextIO) -> None:
        """Write to ``stream``."""
        self.stream = stream

    def write(self, text: str) -> int:
        """Write a text; what the encoding of the stream lacks is escaped, too."""
        encoding = self.stream.encoding or 'utf-8'
        shown = escaped(text, kept='\n\t').encode(encoding, 'backslashreplace').decode(encoding)
        return self.stream.write(shown)

    def flush(self) -> None:
        """Flush the stream."""
        self.stream.flush()

    def fileno(self) -> int:
        """Return the file descriptor of the stream."""
        return self.stream.fileno()


@contextmanager
def escaped_output() -> Iterator[None]:
    """Escape what is printed in the block."""
    with redirect_stdout(Escaping(sys.stdout)), redirect_stderr(Escaping(sys.stderr)):
        yield


def screen() -> TextIO:
    """Return the standard error as it is, to draw on a terminal."""
    return sys.stderr.stream if isinstance(sys.stderr, Escaping) else sys.stderr
