"""Blocks of snapshots, and decompositions of one matrix, against the general forms."""

from typing import Any

import numpy as np
import pytest
from subspace_scenes import LINE, incoherent

from arrivals.trackers import PAST, create
from arrivals.trackers.subspace.decompositions import (
    eigenvalues,
    largest_eigenvectors,
    least_squares,
)
from arrivals.typing import Complex

BLOCK = 10


def random_matrix(*shape: int, seed: int = 0) -> Complex:
    return np.asarray(np.random.default_rng(seed).standard_normal((*shape, 2)) @ [1, 1j])


def test_past_of_blocks_equals_that_of_single_snapshots() -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    single = PAST(LINE, n_sources=2, forgetting=0.9)
    blocks = PAST(LINE.replace(n_snapshots=BLOCK), n_sources=2, forgetting=0.9)
    for block in z.reshape(-1, BLOCK, z.shape[1]):
        blocks.predict()
        blocks.update(block)
        single.predict()
        for snapshot in block:
            single.update(snapshot)
    for name in ("W", "inverse", "energy", "prior", "weight", "age"):
        np.testing.assert_allclose(getattr(blocks, name), getattr(single, name), atol=1e-10)
    np.testing.assert_allclose(blocks.estimate.doa, single.estimate.doa, atol=1e-10)


@pytest.mark.parametrize("name", ["music", "esprit", "root_music"])
def test_directions_of_a_known_number_equal_those_of_an_estimated_one(name: str) -> None:
    z, _ = incoherent(LINE, [-0.4, 0.3])
    known = create(name, measurement=LINE, n_sources=2).run(z)
    estimated = create(name, measurement=LINE, n_sources="mdl", max_sources=2).run(z)
    assert (estimated.n_found[50:] == 2).all()
    np.testing.assert_allclose(known.doa[50:], estimated.doa[50:, :2], atol=1e-10)


def test_directions_of_fewer_snapshots_than_sources_use_all_eigenvectors() -> None:
    sizes: list[Any] = []

    class Recorded(type(create("esprit", measurement=LINE))):  # type: ignore[misc]
        def eigendecomposition(self, *args: Any) -> Any:
            sizes.append(args[2])
            return super().eigendecomposition(*args)

    Recorded(LINE, n_sources=2).run(incoherent(LINE, [-0.4, 0.3])[0][:3])
    assert sizes == [None, 2, 2]


@pytest.mark.parametrize("n", [1, 3, 6, None])
def test_largest_eigenvectors_are_those_of_numpy(n: int | None) -> None:
    A = random_matrix(6, 9)
    R = A @ A.conj().T
    values, vectors = largest_eigenvectors(R, n)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(R)[::-1][:n], rtol=1e-12)
    np.testing.assert_allclose(R @ vectors, values * vectors, atol=1e-11)
    several = largest_eigenvectors(np.stack([R, 2 * R]), n)
    np.testing.assert_allclose(several[0][1, :n], 2 * values, rtol=1e-12)


def test_eigenvalues_are_those_of_numpy() -> None:
    A = random_matrix(2, 5, 5)
    for one in A:
        expected = np.sort(np.linalg.eigvals(one))
        np.testing.assert_allclose(np.sort(eigenvalues(one)), expected, rtol=1e-11)
    np.testing.assert_allclose(np.sort(eigenvalues(A)[1]), np.sort(eigenvalues(A[1])), rtol=1e-11)


@pytest.mark.parametrize("rank", [3, 2, 0])
def test_least_squares_solution_is_that_of_the_pseudoinverse(rank: int) -> None:
    A = random_matrix(6, rank) @ random_matrix(rank, 3, seed=1)
    B = random_matrix(6, 2, seed=2)
    expected = np.linalg.pinv(A) @ B
    np.testing.assert_allclose(least_squares(A, B), expected, atol=1e-10)
    np.testing.assert_allclose(least_squares(A[None], B)[0], expected, atol=1e-10)
