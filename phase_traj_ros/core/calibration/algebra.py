# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Batched rotations, and products and solutions of matrices that OpenBLAS does not thread."""

import cv2
import numpy as np
from phase_traj_ros.core.camera.lens_family import Numbers

# Multiplications in a block: half of those from which OpenBLAS uses several threads.
_MAX_BLOCK = 1 << 17
# Unknowns: a little more than half of those from which it does.
_MAX_UNKNOWNS = 60


def transposed_product(left: Numbers, right: Numbers) -> Numbers:
    """
    Return ``left.T @ right``, bit by bit the same with any number of threads.

    The sum is over blocks that are too small to be divided among threads.
    """
    block = max(_MAX_BLOCK // (left.shape[1] * right.shape[1]), 1)
    whole = len(left) // block * block
    first, second = (side[:whole].reshape(-1, block, side.shape[1]) for side in (left, right))
    result: Numbers = (first.transpose(0, 2, 1) @ second).sum(axis=0)
    return result + left[whole:].T @ right[whole:]


def solve(matrix: Numbers, right: Numbers) -> Numbers:
    """
    Return X of ``matrix @ X = right``, (N, N) and (N, M), the same with any number of threads.

    The matrix is positive definite. A large system is solved by halves: the first half of the
    unknowns is eliminated from the equations of the second. Threads would gain nothing for these
    sizes, and wait for work at the cost of a whole core.

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is singular.

    """
    if len(matrix) <= _MAX_UNKNOWNS:
        return np.asarray(np.linalg.solve(matrix, right), np.float64)
    half = len(matrix) // 2
    mixed = matrix[half:, :half]
    eliminated = solve(matrix[:half, :half], np.column_stack([mixed.T, right[:half]]))
    by_second, alone = eliminated[:, :len(mixed)], eliminated[:, len(mixed):]
    second = solve(matrix[half:, half:] - mixed @ by_second, right[half:] - mixed @ alone)
    return np.concatenate([alone - by_second @ second, second])


def matvec(matrix: Numbers, vector: Numbers) -> Numbers:
    """Return ``matrix @ vector``, the same with any number of threads."""
    result: Numbers = np.einsum('ij,j->i', matrix, vector)
    return result


def batch_matvec(matrices: Numbers, vectors: Numbers) -> Numbers:
    """Return the products of matrices (N, M, 3) and vectors (N, 3), one by one."""
    result: Numbers = np.einsum('nij,nj->ni', matrices, vectors)
    return result


def cross_matrices(vectors: Numbers) -> Numbers:
    """Return the cross-product matrices (N, 3, 3) of vectors (N, 3)."""
    x, y, z = vectors.T
    matrices = np.zeros((len(vectors), 3, 3))
    matrices[:, 0, 1], matrices[:, 0, 2], matrices[:, 1, 2] = -z, y, -x
    matrices[:, 1, 0], matrices[:, 2, 0], matrices[:, 2, 1] = z, -y, x
    return matrices


def rotation_matrices(vectors: Numbers) -> Numbers:
    """Return the rotation matrices (N, 3, 3) of rotation vectors (N, 3)."""
    return np.array([cv2.Rodrigues(vector)[0] for vector in vectors])
