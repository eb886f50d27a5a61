"""Groups of candidates that see much the same, in groups of groups: what a proof decides on besides single candidates.

Input a `CoverProblem`, output which candidates each group holds. Of two groups either one holds the other or they share
nobody. Candidates a step apart can stand in for each other, so that leaving one out changes little; that a room takes
three stations at most, or four at least, changes much.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.select.problem import CoverProblem

#: Distances between all candidates are held at once: beyond so many there are no groups.
MOST_CANDIDATES = 2500


def groups_of(problem: CoverProblem) -> BoolArray:
    """(G, N) bool: members of groups of two or more candidates and fewer than all; small groups first.

    The two nearest groups are merged, again and again: near is what shares most rows of all that either sees, in the
    mean over pairs of members.
    """
    from scipy.cluster import hierarchy

    n = problem.n_candidates
    if not 3 <= n <= MOST_CANDIDATES:
        return np.zeros((0, n), dtype=bool)
    pairs = np.triu_indices(n, 1)
    merged = hierarchy.linkage(1.0 - _likeness(problem)[pairs], method="average")[:, :2].astype(np.int64)
    return _members(merged, n)


def _likeness(problem: CoverProblem) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """(N, N): rows that two candidates share, over rows that either sees."""
    from scipy import sparse

    n = problem.n_candidates
    sees = sparse.csr_matrix(
        (np.ones(problem.row.size, dtype=np.int64), problem.row, problem.starts), shape=(n, problem.n_rows)
    )
    shared = (sees @ sees.T).toarray()
    size = np.diff(problem.starts)
    return np.asarray(shared / np.maximum(size[:, None] + size[None] - shared, 1))


def _members(merged: Int64Array, n: int) -> BoolArray:
    """Groups from (N - 1, 2) which two became one, the first n being single candidates; small ones first."""
    held: BoolArray = np.zeros((n + len(merged), n), dtype=bool)
    held[np.arange(n), np.arange(n)] = True
    for number, (a, b) in enumerate(merged.tolist()):
        held[n + number] = held[a] | held[b]
    groups = held[n:-1]
    return groups[np.argsort(groups.sum(axis=1), kind="stable")]
