from typing import cast

import numpy as np
import pytest

from fras_sim.fem.tensors import Nine, determinant, inverse_transposed, positive_part

A, B = np.empty((3, 3)), np.empty((3, 3))


def symmetric(six):
    xx, yy, zz, xy, yz, xz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def six(m):
    return (m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[1, 2], m[0, 2])


@pytest.mark.parametrize(
    ("eigenvalues", "tolerance"),
    [
        ((2.0, 1.0, 0.5), 1e-13),
        ((-2.0, -1.0, -0.5), 1e-13),
        ((2.0, 1.0, -0.5), 1e-13),
        ((2.0, -1.0, -0.5), 1e-13),
        ((1.0, -1.0, -1.0), 1e-13),
        ((1.0, 1.0, -1e-3), 1e-12),
        ((1.0, 1e-9, -1e-9), 1e-9),
        ((1.0, 0.0, 0.0), 1e-9),
        ((3.0, 3.0, 3.0), 1e-13),
        ((-3.0, -3.0, -3.0), 1e-13),
        ((0.0, 0.0, 0.0), 0.0),
    ],
)
def test_positive_part_agrees_with_its_eigenvalues(eigenvalues, tolerance):
    rng = np.random.default_rng(3)
    for _ in range(200):
        turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        matrix = (turn * eigenvalues) @ turn.T
        expected = (turn * np.maximum(eigenvalues, 0.0)) @ turn.T
        found = symmetric(positive_part(six((matrix + matrix.T) / 2), A, B))
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance)


def test_positive_part_of_random_matrices():
    rng = np.random.default_rng(4)
    for _ in range(500):
        matrix = rng.standard_normal((3, 3))
        matrix = matrix + matrix.T
        values, vectors = np.linalg.eigh(matrix)
        expected = (vectors * np.maximum(values, 0)) @ vectors.T
        np.testing.assert_allclose(
            symmetric(positive_part(six(matrix), A, B)), expected, atol=1e-10
        )


def test_inverse_and_determinant():
    F = np.random.default_rng(5).standard_normal((3, 3))
    nine = cast("Nine", tuple(F.ravel()))
    J = determinant(nine)
    assert pytest.approx(np.linalg.det(F)) == J
    inverse = np.reshape(inverse_transposed(nine, J), (3, 3))
    np.testing.assert_allclose(inverse, np.linalg.inv(F).T)
