# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Links and openings of the docs."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob('*.md'), *ROOT.glob('docs/**/*.md')])
LINK = re.compile(r'\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for text, target, anchor in LINK.findall(page.read_text(encoding='utf-8')):
        if target.startswith(('http://', 'https://')):
            continue
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), f'{page.name}: {target}'
        if anchor:
            heads = re.findall(r'^#+ (.*)$', path.read_text(encoding='utf-8'), re.MULTILINE)
            anchors = [re.sub(r'[^\w -]', '', head.lower()).replace(' ', '-') for head in heads]
            assert anchor[1:] in anchors, f'{page.name}: {target}{anchor}'
        if text.startswith('test_'):
            assert f'def {text}(' in path.read_text(encoding='utf-8'), f'{page.name}: {text}'


@pytest.mark.parametrize(
    'page', sorted(ROOT.glob('docs/**/*.md')), ids=lambda page: str(page.relative_to(ROOT)))
def test_every_page_opens_with_what_it_is_for(page):
    title, opening = page.read_text(encoding='utf-8').split('\n\n')[:2]
    assert title.startswith('# ') and '\n' not in title
    assert re.match(r'This (page|section|tutorial|package) ', opening), opening
