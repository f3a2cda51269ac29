# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""No name reaches a terminal with codes that it would execute."""

import io
import sys

from hypothesis import given, strategies as st
from phase_traj_ros.cli.escaping import escaped, escaped_output, Escaping, screen
from phase_traj_ros.cli.main import main

EVIL = 'a\x1b]0;owned\x07b\x9bc\rd\udcffe'


@given(st.text())
def test_what_is_escaped_is_printable_and_the_rest_as_it_was(text):
    assert escaped(text).isprintable()
    assert escaped(text) == text or not text.isprintable()
    written = io.StringIO()
    Escaping(written).write(f'{text}\n')
    assert all(sign.isprintable() or sign in '\n\t' for sign in written.getvalue())


def test_what_the_encoding_of_a_stream_lacks_is_escaped():
    written = io.BytesIO()
    stream = io.TextIOWrapper(written, encoding='ascii')
    Escaping(stream).write('written to straße\n')
    stream.flush()
    assert written.getvalue() == b'written to stra\\xdfe\n'


def test_output_and_errors_are_escaped_and_the_screen_is_not(capsys):
    with escaped_output():
        print(EVIL)
        print(EVIL, file=sys.stderr)
        print('\x1b[2J', file=screen())
    out, err = capsys.readouterr()
    assert out == 'a\\x1b]0;owned\\x07b\\x9bc\\rd\\udcffe\n'
    assert err == f'{out}\x1b[2J\n'


def test_a_file_name_in_an_error(capsys, tmp_path):
    assert main(['replay', f'{tmp_path}/{EVIL}\nx']) == 2
    error = capsys.readouterr().err
    assert error.endswith('\n') and error[:-1].isprintable() and '\\x1b]0;owned' in error
