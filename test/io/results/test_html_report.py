# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The report: what is in the file, and what a real browser makes of it."""

import base64
from dataclasses import replace
import hashlib
from html.parser import HTMLParser
import json
import re

from browser import find_browser, opened_browser
from far_scene import turned_drive
import numpy as np
from phase_traj_ros.core import Axes, normalised, to_axes
from phase_traj_ros.io.replay.overview import overview
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.figures import write_trajectory_picture
from phase_traj_ros.io.results.files import write_results
from phase_traj_ros.io.results.pictures import Thumbnails
from phase_traj_ros.io.results.report import report as html_report
from phase_traj_ros.io.results.report.page import filled, Markup, script_json, table
from phase_traj_ros.io.results.report.report import write_report
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from polyline import off
import pytest
from rolled import rolled_frames, SHIFTS

NASTY = '</script><img src=x onerror="alert(1)">&<b>\'"{{data}}\udcff'


def report(path, frames, *, title='drive', source='drive', parameters=None):
    thumbnails = Thumbnails()
    result = replay(
        frames, parameters or Parameters(threshold=16.0), source=source, watchers=[thumbnails])
    picture = path.with_suffix('.png')
    write_trajectory_picture(result, picture)
    write_report(
        result, path, title=title, picture=picture, thumbnails=thumbnails.kept)
    return result


@pytest.fixture(scope='module')
def page_file(tmp_path_factory):
    path = tmp_path_factory.mktemp('report') / 'report.html'
    report(
        path, rolled_frames(), title=NASTY, source=NASTY,
        parameters=Parameters(threshold=16.0, max_gap=2.5))
    return path


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    if find_browser() is None:
        pytest.skip('no Chromium here')
    with opened_browser(tmp_path_factory.mktemp('profile')) as found:
        yield found


@pytest.fixture(scope='module')
def page(browser, page_file):
    return browser.page(page_file)


class Reader(HTMLParser):
    """Gathers elements and texts."""

    def __init__(self, path):
        super().__init__()
        self.elements = []
        self.texts = []
        self.data = ''
        self._inside = None
        self.feed(path.read_text(encoding='utf-8'))

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        self._inside = dict(attributes).get('id') if tag == 'script' else None

    def handle_endtag(self, tag):
        self._inside = None

    def handle_data(self, text):
        if self._inside == 'data':
            self.data += text
        elif text.strip():
            self.texts.append(text.strip())


@pytest.fixture(scope='module')
def read(page_file):
    return Reader(page_file)


def test_it_names_nothing_outside_of_itself(read, page_file):
    # Addresses of other things, and the elements that would load them.
    sources = [
        value for _, attributes in read.elements for name, value in attributes.items()
        if name in ('src', 'href', 'srcset', 'action', 'poster', 'background')]
    assert sources and all(value.startswith('data:image/') for value in sources)
    assert not {'link', 'iframe', 'object', 'embed', 'base', 'form'} & {
        tag for tag, _ in read.elements}
    text = page_file.read_text(encoding='utf-8')
    assert not re.search(r'https?://|@import|url\(', text)
    [policy] = [
        each['content'] for tag, each in read.elements if 'http-equiv' in each]
    assert policy.startswith("default-src 'none'; img-src data:;")


def test_names_of_files_cannot_become_markup(read):
    shown = NASTY.replace('\udcff', '\\udcff')
    # Title, heading and source.
    assert read.texts.count(shown) == 3
    assert not [tag for tag, each in read.elements if 'onerror' in each or tag == 'b']


def test_its_data_are_those_of_the_replay(read):
    data = json.loads(read.data)
    result = replay(rolled_frames(), Parameters(threshold=16.0), source='')
    assert data['movement'] == ''.join(str(int(code)) for code in result.movement)
    np.testing.assert_allclose(data['dx'], SHIFTS, atol=0.1)
    assert data['threshold'] == 16.0 and data['heading'] is None
    assert [(turn['number'], turn['side'], turn['pair']) for turn in data['turns']] == [
        (1, 'left', 3), (2, 'right', 9)]
    assert [each['frame'] for each in data['thumbnails']] == list(range(len(SHIFTS) + 1))


def test_it_tells_of_settings_and_health(read):
    assert 'max_gap' in read.texts and '2.5 s' in read.texts
    for text in ('Health of the data', 'pairs with status turning', '3 (21.4 %)', '100.0 ms'):
        assert text in read.texts
    assert any(text.startswith('movement (14): 1×3 0×1 3×2') for text in read.texts)


def test_a_drive_without_turns_or_measurement(tmp_path):
    frames = [
        StampedFrame(np.zeros((96, 160), np.uint8), index * 10**8) for index in range(4)]
    report(tmp_path / 'report.html', frames)
    read = Reader(tmp_path / 'report.html')
    assert any(text == 'The codes contain no turn.' for text in read.texts)
    assert json.loads(read.data)['turns'] == []


@pytest.mark.parametrize(('source', 'name'), [('auto', 'the turns'), ('heading', 'the heading')])
def test_it_tells_what_the_codes_are_from(tmp_path, source, name):
    report(
        tmp_path / 'report.html', rolled_frames(),
        parameters=Parameters(focal_px=200.0, code_source=source))
    texts = Reader(tmp_path / 'report.html').texts
    assert texts[texts.index('codes from') + 1] == name


def test_it_tells_why_a_calibration_is_not_used(tmp_path):
    result = replace(
        replay(rolled_frames(), Parameters(threshold=16.0), source='drive'),
        unused_calibration='K is zero')
    picture = tmp_path / 'picture.png'
    write_trajectory_picture(result, picture)
    write_report(result, tmp_path / 'report.html', title='drive', picture=picture)
    assert 'The calibration is not used: K is zero.' in Reader(tmp_path / 'report.html').texts


def test_the_page_loads_without_a_complaint_and_loads_nothing(page, page_file):
    assert page.run('document.readyState') == 'complete'
    assert page.complaints() == []
    assert {url.partition(',')[0].partition(';')[0] for url in page.loaded()} <= {
        page_file.as_uri(), 'data:image/jpeg', 'data:image/png'}
    assert page.run('document.title') == NASTY.replace('\udcff', '\\udcff')
    # Every picture has arrived and has pixels; every canvas is drawn upon.
    assert page.run('[...document.images].every(i => i.complete && i.naturalWidth > 0)')
    assert page.run(
        "[...document.querySelectorAll('canvas')].every(c => c.getContext('2d')"
        '.getImageData(0, 0, c.width, c.height).data.some(value => value > 0))')
    assert page.run("document.querySelectorAll('.turns img').length") == 6


def frame_shown(page):
    return page.run(
        "[document.getElementById('frame').src, "
        "Number(document.getElementById('frame').dataset.frame)]")


def readout(page):
    return page.run(
        "Object.fromEntries([...document.querySelectorAll('#readout div')].map("
        "e => ['dt', 'dd'].map(tag => e.querySelector(tag).textContent)))")


def test_moving_the_cursor_changes_the_frame_and_what_is_told_of_it(page, read):
    thumbnails = {each['frame']: each['src'] for each in json.loads(read.data)['thumbnails']}
    left, top, width, height = page.box('#plots')
    seen = []
    for share in (0.12, 0.4, 0.7, 0.95):
        page.mouse('mouseMoved', left + share * width, top + height / 2)
        source, frame = frame_shown(page)
        assert source == thumbnails[frame]
        assert readout(page)['frame'] == str(frame)
        seen.append(frame)
    assert seen == sorted(set(seen)) and seen[0] <= 2 and seen[-1] >= 13
    assert page.complaints() == []


def test_the_frame_is_the_one_at_that_time(page):
    # The right turn begins with the pair of the 10th and the 11th frame, at 1.0 s of 1.4 s.
    left, top, width, _ = page.box('#plots')
    page.mouse('mouseMoved', left + 72 + (width - 72 - 14) * 1.0 / 1.4, top + 80)
    assert frame_shown(page)[1] == 10
    told = readout(page)
    assert 0.02 < float(told.pop('response')) <= 1
    assert told == {
        'time': '1.00 s', 'frame': '10', 'shift': '−40.0 px', 'movement': '2 right',
        'direction': '1 forward', 'status': 'ok'}
    assert page.run("document.getElementById('badge').textContent") == 'turn 2, right'


def test_keys_go_frame_by_frame_and_turns_can_be_chosen(page):
    page.run("document.getElementById('plots').focus()")
    page.press('Home')
    assert frame_shown(page)[1] == 1
    page.press('ArrowRight')
    page.press('ArrowRight')
    assert frame_shown(page)[1] == 3
    page.press('End')
    page.press('ArrowRight')
    assert frame_shown(page)[1] == 14
    page.run("document.querySelectorAll('.turns button')[1].click()")
    assert frame_shown(page)[1] == 10


def test_dragging_zooms_and_a_double_click_shows_all_again(page):
    left, top, width, _ = page.box('#plots')
    place, y = left + 0.5 * width, top + 80
    page.mouse('mouseMoved', place, y)
    before = frame_shown(page)[1]
    page.mouse('mousePressed', left + 0.1 * width, y, button='left', clickCount=1)
    page.mouse('mouseMoved', left + 0.3 * width, y, button='left')
    page.mouse('mouseReleased', left + 0.3 * width, y, button='left', clickCount=1)
    page.mouse('mouseMoved', place, y)
    zoomed = frame_shown(page)[1]
    assert zoomed < before
    for count in (1, 2):
        page.mouse('mousePressed', place, y, button='left', clickCount=count)
        page.mouse('mouseReleased', place, y, button='left', clickCount=count)
    page.mouse('mouseMoved', place + 1, y)
    assert frame_shown(page)[1] == before
    assert page.complaints() == []


def test_with_a_heading_there_is_one_more_plot(browser, tmp_path, monkeypatch):
    def with_heading(result):
        shown = overview(result)
        turns = tuple(replace(turn, angle_deg=91.5) for turn in shown.turns)
        return replace(shown, heading_deg=np.cumsum(shown.dx), turns=turns)

    monkeypatch.setattr(html_report, 'overview', with_heading)
    report(tmp_path / 'report.html', rolled_frames())
    assert '+91.5°' in Reader(tmp_path / 'report.html').texts
    page = browser.page(tmp_path / 'report.html', width=600)
    assert page.complaints() == []
    assert page.box('#plots')[3] > 400
    assert re.fullmatch(r'\d+\.\d°', readout(page)['heading'])


# Notes the lines that are drawn on the map, as they are stroked.
NOTE_LINES = """
    (() => {
      const pen = CanvasRenderingContext2D.prototype;
      const { beginPath, lineTo, stroke } = pen;
      let line = [];
      pen.beginPath = function () { line = []; return beginPath.call(this); };
      pen.lineTo = function (x, y) { line.push([x, y]); return lineTo.call(this, x, y); };
      pen.stroke = function () {
        if (this.canvas.id === 'map' && line.length) window.drawn = line;
        return stroke.call(this);
      };
    })();"""


@pytest.fixture(scope='module')
def turned():
    """Return the camera and the frames of a drive with turns to both sides."""
    camera, pictures = turned_drive()
    return camera, [StampedFrame(picture, index * 10**8) for index, picture in enumerate(pictures)]


@pytest.mark.parametrize('values', [
    {'code_source': 'shift'},
    # The camera turns on the spot: a path along the heading needs a speed.
    {'code_source': 'shift', 'path_from': 'heading', 'speed': 0.02},
    {'code_source': 'auto', 'speed': 0.02},
    {'code_source': 'heading'},
    {'code_source': 'heading', 'path_from': 'heading', 'speed': 0.02},
    {'code_source': 'heading', 'connectivity': 8},
    {'code_source': 'heading', 'connectivity': 8, 'path_from': 'heading', 'speed': 0.02},
], ids=lambda values: ', '.join(map(str, values.values())) or 'defaults')
def test_the_path_is_the_one_that_is_written(browser, turned, tmp_path, values):
    camera, frames = turned
    result = report(
        tmp_path / 'report.html', frames, parameters=Parameters(focal_px=camera.fx, **values))
    write_results(result, tmp_path)
    written = np.loadtxt(tmp_path / 'trajectory.tum')[:, 1:3]
    written = normalised(to_axes(written, Axes.FIGURE))
    page = browser.page(tmp_path / 'report.html', before=NOTE_LINES)
    assert page.complaints() == []
    drawn = np.array(page.run('window.drawn')) * (1, -1)
    assert np.ptp(drawn, axis=0).max() > 200
    drawn = normalised(drawn)
    assert off(written, drawn) < 0.01 and off(drawn, written) < 0.01
    assert drawn[-1] == pytest.approx(written[-1], abs=0.01)
    # It goes to the right, and less far back to the left.
    assert 0.05 < written[-1, 0] < written[:, 0].max() - 0.05
    page.run("document.getElementById('plots').focus()")
    page.press('End')
    last = result.updates[-1].step.direction
    assert readout(page)['direction'] == f'{int(last)} forward'
    codes = {int(update.step.direction) for update in result.updates}
    assert codes == ({0, 1, 2, 3, 4} if 'connectivity' in values else {0, 1, 2})


def test_pieces_of_pages():
    assert filled('{{a}}{{b}}', {'a': '{{b}}<', 'b': Markup('<i>')}) == '{{b}}&lt;<i>'
    assert '<td>&lt;x&gt;</td><td class=number>1</td>' in table(
        [('<x>', '1')], numbers=(1,))
    hostile = {'</script><!--': '&\u2028'}
    text = script_json(hostile)
    assert not set(text) & set('<>&') and json.loads(text) == hostile


def test_only_its_own_script_may_run(page_file):
    text = page_file.read_text(encoding='utf-8')
    [policy] = re.findall(r'http-equiv="Content-Security-Policy"\s+content="([^"]*)"', text)
    [script] = re.findall(r'<script>(.*?)</script>', text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy
    assert 'unsafe' not in policy.split('script-src')[1]
