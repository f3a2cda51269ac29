# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, controlled over a pipe by its DevTools protocol: nothing to install."""

from contextlib import contextmanager
import json
import os
from pathlib import Path
import select
import shutil
import subprocess
import time

_NAMES = ('chromium', 'google-chrome', 'google-chrome-stable', 'chrome')
_FLAGS = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--disable-dev-shm-usage', '--hide-scrollbars', '--remote-debugging-pipe')
_PATIENCE_S = 60


def find_browser():
    """Return the path of a Chromium, or None; one in a snap cannot read temporary files."""
    for name in _NAMES:
        path = shutil.which(name)
        if path is not None and 'snap' not in Path(path).resolve().parts:
            return path
    return None


@contextmanager
def opened_browser(profile):
    """Start a browser with an empty profile; yield a Browser; terminate it."""
    to_browser, our_write = os.pipe()
    our_read, from_browser = os.pipe()
    # The browser reads from file 3 and writes to file 4.
    script = f'exec 3<&{to_browser} 4>&{from_browser}; exec "$0" "$@"'
    process = subprocess.Popen(
        ['bash', '-c', script, find_browser(), *_FLAGS, f'--user-data-dir={profile}'],
        pass_fds=(to_browser, from_browser), stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(to_browser)
    os.close(from_browser)
    try:
        yield Browser(our_read, our_write)
    finally:
        process.kill()
        process.wait()
        os.close(our_read)
        os.close(our_write)


class Browser:
    """Sends commands, and keeps the events received meanwhile."""

    def __init__(self, read, write):
        self._read = read
        self._write = write
        self._rest = b''
        self._number = 0
        self.events = []

    def page(self, path, *, width=1200, height=2400, before=''):
        """
        Open a file in a new tab; return a Page after it has loaded.

        ``before`` is a script that runs before those of the page.
        """
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        session = self.call('Target.attachToTarget', targetId=target, flatten=True)['sessionId']
        page = Page(self, session)
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            page.call(f'{domain}.enable')
        page.call(
            'Emulation.setDeviceMetricsOverride', width=width, height=height,
            deviceScaleFactor=1, mobile=False)
        page.call('Page.addScriptToEvaluateOnNewDocument', source=before)
        self.events.clear()
        page.call('Page.navigate', url=Path(path).as_uri())
        deadline = time.monotonic() + _PATIENCE_S
        while not page.seen('Page.loadEventFired'):
            self._take(deadline)
        return page

    def call(self, method, session=None, **params):
        """Send a command; return its result."""
        self._number += 1
        message = {'id': self._number, 'method': method, 'params': params}
        if session is not None:
            message['sessionId'] = session
        os.write(self._write, json.dumps(message).encode() + b'\0')
        deadline = time.monotonic() + _PATIENCE_S
        while True:
            answer = self._take(deadline)
            if answer.get('id') == self._number:
                assert 'error' not in answer, answer
                return answer['result']

    def _take(self, deadline):
        while b'\0' not in self._rest:
            ready, _, _ = select.select([self._read], [], [], deadline - time.monotonic())
            assert ready, 'the browser says nothing'
            data = os.read(self._read, 1 << 20)
            assert data, 'the browser has ended'
            self._rest += data
        text, _, self._rest = self._rest.partition(b'\0')
        message = json.loads(text)
        if 'method' in message:
            self.events.append(message)
        return message


class Page:
    """An open page."""

    def __init__(self, browser, session):
        self._browser = browser
        self._session = session

    def call(self, method, **params):
        """Send a command for this page; return its result."""
        return self._browser.call(method, self._session, **params)

    def seen(self, method):
        """Return the parameters of all events of a kind since the page was opened."""
        return [
            event['params'] for event in self._browser.events
            if event['method'] == method and event.get('sessionId') == self._session]

    def run(self, script):
        """Return the value of an expression."""
        answer = self.call(
            'Runtime.evaluate', expression=script, returnByValue=True, awaitPromise=True)
        assert 'exceptionDetails' not in answer, answer
        return answer['result'].get('value')

    def box(self, selector):
        """Return the rectangle of an element: left, top, width, height."""
        return self.run(
            f'(() => {{ const r = document.querySelector({json.dumps(selector)})'
            '.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()')

    def mouse(self, kind, x, y, **params):
        """Move the mouse, or press or release its button: mouseMoved and so on."""
        self.call('Input.dispatchMouseEvent', type=kind, x=x, y=y, **params)

    def press(self, key):
        """Press a key."""
        self.call('Input.dispatchKeyEvent', type='keyDown', key=key, code=key)
        self.call('Input.dispatchKeyEvent', type='keyUp', key=key, code=key)

    def complaints(self):
        """Return the console messages and errors of the page."""
        return [
            self.seen(method) for method in (
                'Runtime.exceptionThrown', 'Runtime.consoleAPICalled', 'Log.entryAdded')
            if self.seen(method)]

    def loaded(self):
        """Return the schemes and addresses of all requests."""
        return [each['request']['url'] for each in self.seen('Network.requestWillBeSent')]
