"""Disjoint sets of detections of the largest total weight."""

from __future__ import annotations

from collections.abc import Hashable, Sequence, Set

import numpy as np
from numpy.typing import ArrayLike

from arrivals.messages import shown
from arrivals.validation import count, not_negative, real


def packings(
    members: Sequence[Set[Hashable]],
    weights: ArrayLike,
    *,
    within: float = 8.0,
    max_sets: int = 40,
    max_nodes: int = 4000,
) -> list[tuple[tuple[int, ...], float]]:
    """Return the best choices of disjoint sets of detections, the best first.

    Branch and bound, from the heaviest set to the lightest.

    Parameters
    ----------
    members : sequence of set
        Detections of each set, such as pairs (station, bearing).
    weights : array_like, shape (n_sets,)
        Weights of the sets, positive.
    within : float
        Difference from the largest total up to which packings are returned.
    max_sets : int
        Number of the heaviest sets that are considered.
    max_nodes : int
        Nodes visited at most; the first packing found is the greedy one.

    Returns
    -------
    list of (tuple of int, float)
        Indices of the sets of each packing, by falling weight, and its total. The empty packing
        alone without sets.

    Raises
    ------
    ValueError
        If a weight is not finite and positive, or their number is not that of the sets.

    Examples
    --------
    >>> packings([{1, 2}, {2, 3}, {3, 4}], [5.0, 6.0, 3.0], within=2.0)
    [((0, 2), 8.0), ((1,), 6.0)]
    """
    w = real("weights", weights)
    if w.shape != (len(members),):
        raise ValueError(f"weights must have shape ({len(members)},); got {w.shape}")
    if not ((w > 0) & (w < np.inf)).all():
        raise ValueError(f"weights must be finite and positive; got {shown(w)}")
    within = not_negative("within", within)
    order = np.argsort(-w, kind="stable")[: count("max_sets", max_sets)].tolist()
    w_sorted = w[order].tolist()
    bits = _masks([members[i] for i in order])
    disjoint = [sum(1 << k for k, b in enumerate(bits) if not b & a) for a in bits]
    found = _search(w_sorted, disjoint, _cliques(bits), within, count("max_nodes", max_nodes))
    best = max(total for total, _ in found)
    found = [each for each in found if each[0] >= best - within]
    found.sort(key=lambda each: -each[0])
    return [(tuple(order[i] for i in chosen), total) for total, chosen in found]


def _search(
    w: list[float], disjoint: list[int], cliques: list[int], within: float, max_nodes: int
) -> list[tuple[float, tuple[int, ...]]]:
    """Return the packings found, depth first, with the sets of bit masks still free in a node."""
    found: list[tuple[float, tuple[int, ...]]] = []
    best = -np.inf
    stack: list[tuple[int, float, tuple[int, ...]]] = [((1 << len(w)) - 1, 0.0, ())]
    n_nodes = 0
    while stack and (n_nodes < max_nodes or not found):
        free, total, chosen = stack.pop()
        n_nodes += 1
        if not free:
            found.append((total, chosen))
            best = max(best, total)
            continue
        # of a clique, sets that share a detection, at most one is chosen: its first is heaviest
        bound = total
        for clique in cliques:
            if here := clique & free:
                bound += w[(here & -here).bit_length() - 1]
        if bound < best - within:
            continue
        first = free & -free
        i = first.bit_length() - 1
        stack.append((free ^ first, total, chosen))
        stack.append((free & disjoint[i] & ~first, total + w[i], (*chosen, i)))
    return found


def _masks(sets: list[Set[Hashable]]) -> list[int]:
    """Return the detections of each set as the bits of a number."""
    index: dict[Hashable, int] = {}
    return [sum(1 << index.setdefault(d, len(index)) for d in each) for each in sets]


def _cliques(bits: list[int]) -> list[int]:
    """Return a partition of sets into such that share a detection, as bit masks."""
    left = (1 << len(bits)) - 1
    columns = [
        sum(1 << k for k, b in enumerate(bits) if b >> d & 1)
        for d in range(max((b.bit_length() for b in bits), default=0))
    ]
    cliques = []
    while left:
        clique = (
            max((column & left for column in columns), key=int.bit_count, default=0) or left & -left
        )
        cliques.append(clique)
        left &= ~clique
    return cliques
