"""Symmetric matrices as triangles equal the same operations on whole matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from arrivals import symmetric
from arrivals.typing import Float


def whole(C: Float) -> Float:
    """Matrices (L, d, d) of triangles (q, L)."""
    return np.moveaxis(symmetric.full(C), -1, 0)


@st.composite
def positive(draw: st.DrawFn, d: int | None = None) -> Float:
    """Triangles (q, 3) of positive definite matrices."""
    d = draw(st.sampled_from([1, 2])) if d is None else d
    A = draw(arrays(float, (3, d, d), elements=st.floats(-3, 3)))
    return symmetric.triangle(np.moveaxis(A @ A.swapaxes(1, 2) + 0.1 * np.eye(d), 0, -1))


@given(positive())
def test_inverse_and_determinant(C: Float) -> None:
    d = symmetric.SIZES[len(C)]
    product = whole(symmetric.inverse(C)) @ whole(C)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(d), product.shape), atol=1e-8)
    np.testing.assert_allclose(symmetric.log_det(C), np.linalg.slogdet(whole(C))[1], atol=1e-9)


@given(positive(2), st.floats(0.01, 10))
def test_clamped_matrices_have_clamped_eigenvalues(C: Float, limit: float) -> None:
    values = np.linalg.eigvalsh(whole(C))
    for function, expected in (
        (symmetric.clamped, np.maximum(values, limit)),
        (symmetric.limited, np.minimum(values, limit)),
    ):
        got = np.linalg.eigvalsh(whole(function(C, limit)))
        np.testing.assert_allclose(got, np.sort(expected, axis=1), rtol=1e-6, atol=1e-9)
    inverse = np.linalg.inv(whole(symmetric.clamped(C, limit)))
    got = whole(symmetric.clamped_inverse(C, limit))
    np.testing.assert_allclose(got, inverse, rtol=1e-6, atol=1e-12 * np.abs(inverse).max())


@given(positive(2), positive(2), arrays(float, (2, 2, 3), elements=st.floats(-2, 2)))
def test_products_equal_those_of_matrices(C: Float, S: Float, J: Float) -> None:
    turned = np.moveaxis(J, -1, 0)
    np.testing.assert_allclose(
        whole(symmetric.congruent(J, C)), turned.swapaxes(1, 2) @ whole(C) @ turned, atol=1e-9
    )
    trace = np.trace(whole(C) @ whole(S), axis1=1, axis2=2)
    np.testing.assert_allclose(symmetric.trace_of_product(C, S), trace, rtol=1e-9, atol=1e-9)
    v = J[0]
    product = (whole(C) @ v.T[:, :, None])[:, :, 0].T
    np.testing.assert_allclose(symmetric.times(C, v), product, atol=1e-9)


@pytest.mark.parametrize("d", [1, 2])
def test_matrices_between_two_end_at_both(d: int) -> None:
    old, new = (value * symmetric.identity(d) * np.ones(3) for value in (1.0, 4.0))
    np.testing.assert_allclose(symmetric.between(old, new, 1.0), new)
    half = symmetric.between(old, new, 0.5)
    assert (np.linalg.eigvalsh(whole(half)) > 1).all()
    assert (np.linalg.eigvalsh(whole(half)) < 4).all()
