# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Large systems are solved without the threads of OpenBLAS, whose results differ."""

import os
import subprocess
import sys

import numpy as np
from phase_traj_ros.core.calibration.algebra import solve
import pytest

# Prints the bits of all results.
PROGRAM = """
import hashlib
import numpy as np
from phase_traj_ros.core.calibration.algebra import solve, transposed_product
rng, digest = np.random.default_rng(0), hashlib.sha256()
for size in (9, 60, 61, 111, 117, 160):
    rows = rng.normal(size=(2 * size, size))
    matrix = transposed_product(rows, rows)
    digest.update(solve(matrix, rng.normal(size=(size, 3))).tobytes())
print(digest.hexdigest())
"""


def test_solutions_are_the_same_with_any_number_of_threads():
    found = {subprocess.run(
        [sys.executable, '-c', PROGRAM], check=True, capture_output=True, text=True,
        env={**os.environ, 'OPENBLAS_NUM_THREADS': threads}).stdout for threads in '124'}
    assert len(found) == 1


@pytest.mark.parametrize('size', [1, 60, 61, 117, 200])
def test_systems_are_solved_by_halves(size):
    rng = np.random.default_rng(size)
    rows, right = rng.normal(size=(2 * size, size)), rng.normal(size=(size, 2))
    matrix = rows.T @ rows
    np.testing.assert_allclose(
        solve(matrix, right), np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize('size', [2, 117])
def test_a_singular_system_is_an_error(size):
    with pytest.raises(np.linalg.LinAlgError):
        solve(np.zeros((size, size)), np.ones((size, 1)))
