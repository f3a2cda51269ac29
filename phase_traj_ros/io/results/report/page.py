# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Elements of self-contained HTML pages, with all text escaped."""

import base64
from collections.abc import Iterable, Mapping, Sequence
import hashlib
from html import escape
from importlib.resources import files
import json
from pathlib import Path
import re

from phase_traj_ros.io.results.palette import DARK, LIGHT

_TOKEN = re.compile(r'\{\{(\w+)\}\}')


class Markup(str):
    """Text that is HTML already; any other text is escaped."""


def html_of(cell: str) -> str:
    """Return a cell as HTML."""
    return cell if isinstance(cell, Markup) else escape(cell)


def template(name: str) -> str:
    """Return the text of a file in the folder templates."""
    templates = files('phase_traj_ros.io.results.report').joinpath('templates')
    return templates.joinpath(name).read_text(encoding='utf-8')


def filled(page: str, values: Mapping[str, str]) -> Markup:
    """Return a template with each {{name}} replaced; the inserted values are not expanded."""
    return Markup(_TOKEN.sub(lambda match: html_of(values[match[1]]), page))


def table(
    rows: Iterable[Sequence[str]], *, head: Sequence[str] = (), numbers: Sequence[int] = (),
    kind: str = '',
) -> Markup:
    """Return a table; the columns ``numbers`` are aligned to the right."""
    def cells(row: Sequence[str], tag: str) -> str:
        return ''.join(
            f'<{tag}{" class=number" if index in numbers else ""}>{html_of(cell)}</{tag}>'
            for index, cell in enumerate(row))

    lines = [f'<table class="{escape(kind)}">']
    if head:
        lines.append(f'<thead><tr>{cells(head, "th")}</tr></thead>')
    lines.append('<tbody>')
    lines += [f'<tr>{cells(row, "td")}</tr>' for row in rows]
    lines.append('</tbody></table>')
    return Markup('\n'.join(lines))


def data_uri(picture: bytes, kind: str) -> str:
    """Return a picture as a data URI; ``kind`` is png or jpeg."""
    return f'data:image/{kind};base64,{base64.b64encode(picture).decode()}'


def script_json(content: object) -> Markup:
    """Return a value as JSON that is safe in a script element, whatever text it contains."""
    text = json.dumps(content, separators=(',', ':'), allow_nan=False)
    for sign in '<>&':
        text = text.replace(sign, f'\\u{ord(sign):04x}')
    return Markup(text)


def write_page(
    path: Path, *, title: str, facts: Iterable[tuple[str, str]], content: Markup,
    source: str = '', script: str = '',
) -> None:
    """
    Write a page in the shell that all pages share, with a light and a dark palette.

    The facts are terms and their values. The security policy of the page allows nothing but the
    script. Bytes of file names that are not UTF-8 are escaped.
    """
    digest = base64.b64encode(hashlib.sha256(f'\n{script}\n'.encode()).digest()).decode()
    end = f'<script>\n{script}\n</script>' if script else ''
    terms = '\n'.join(
        f'<div><dt>{escape(term)}</dt><dd>{escape(value)}</dd></div>' for term, value in facts)
    style = filled(template('style.css'), {'light': LIGHT.css(), 'dark': DARK.css()})
    page = filled(template('shell.html'), {
        'title': title, 'source': source, 'facts': Markup(terms), 'style': style,
        'scripts': Markup(f"'sha256-{digest}'" if script else "'none'"),
        'content': Markup(content + end)})
    path.write_bytes(page.encode('utf-8', 'backslashreplace'))
