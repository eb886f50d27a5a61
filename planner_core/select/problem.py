"""The selection problem: rows of patches that the same positions see, with their areas, and the areas to be covered.

Input `Visibility`, patch areas (m^2) and targets; output a `CoverProblem`. Its areas are whole numbers of ticks of
1e-9 m^2, so that sums do not depend on their order and two ways to the same plan agree to the last bit.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Visibility

#: Areas are counted in units of 1e-9 m^2: 9e9 m^2 fit in 63 bits, and a patch of 1 mm^2 still has a thousand.
TICKS_PER_M2 = 1e9


@dataclass(frozen=True)
class Constraint:
    """Area to be covered: `fraction` of the achievable patches of `part`, (P,) bool.

    A patch counts where at least `seen_from` chosen candidates see it; achievable is what so many candidates see.
    """

    part: BoolArray
    fraction: float
    seen_from: int = 1


@dataclass(frozen=True)
class CoverProblem:
    """Patches seen by the same candidates and counted by the same targets are one row.

    starts, row : candidates' rows as CSR, (N + 1,) int64 and int32, into which others are turned. ticks : (R,) int64,
    area of each row.
    counts_for : (K, R) bool, rows that each target counts. required : (K,) int64, ticks that surely meet each target.
    least : (K,) int64, ticks below which a target is surely missed. The two differ by the rounding of areas to ticks;
    plans are made for `required`, bounds hold for `least`. seen_from : (K,) int64, at least 1: so many chosen
    candidates have to see a row for it to count for a target; left out, one.
    """

    starts: Int64Array
    row: Int32Array
    ticks: Int64Array
    counts_for: BoolArray
    required: Int64Array
    least: Int64Array
    seen_from: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", self.row.astype(np.int32, copy=False))
        if self.seen_from.size == 0:
            object.__setattr__(self, "seen_from", np.ones(self.required.size, dtype=np.int64))
        if self.seen_from.shape != self.required.shape or (self.seen_from < 1).any():
            raise RequirementError(
                f"seen from: got {self.seen_from.tolist()}, expected {self.required.size} whole numbers, 1 or more each"
            )

    @property
    def n_candidates(self) -> int:
        """Number of positions to choose from."""
        return int(self.starts.size - 1)

    @property
    def n_rows(self) -> int:
        """Number of rows after merging."""
        return int(self.ticks.size)

    def rows_of(self, candidate: int) -> Int32Array:
        """Rows that a candidate covers."""
        return self.row[self.starts[candidate] : self.starts[candidate + 1]]

    def seers(self) -> tuple[Int64Array, Int32Array]:
        """Candidates who see each row, rising, as CSR: (R + 1,) int64 and (E,) int32."""
        from scipy import sparse

        nothing = np.zeros(self.row.size, dtype=np.int8)  # one of the smallest numbers there are, for each entry
        by_row = sparse.csr_array((nothing, self.row, self.starts), shape=(self.n_candidates, self.n_rows)).tocsc()
        return by_row.indptr.astype(np.int64), by_row.indices.astype(np.int32, copy=False)

    def covered(self, chosen: list[int]) -> Int64Array:
        """(K,) int64: ticks of each target that the chosen candidates cover together, as often as it asks."""
        return self.ticks_of(self.times_seen(chosen))

    def times_seen(self, chosen: list[int]) -> Int64Array:
        """(R,) int64: number of the chosen candidates that see each row."""
        n_seen = np.zeros(self.n_rows, dtype=np.int64)
        for candidate in chosen:
            n_seen[self.rows_of(candidate)] += 1
        return n_seen

    def ticks_of(self, n_seen: Int64Array) -> Int64Array:
        """(K,) int64: ticks of each target's rows that are seen often enough, from how often (R,) each is."""
        enough = n_seen >= self.seen_from[:, None]
        ticks: Int64Array = (self.counts_for * np.where(enough, self.ticks, 0)).sum(axis=1)
        return ticks


def cover_problem(
    visibility: Visibility, patch_area_m2: FloatArray, constraints: tuple[Constraint, ...]
) -> CoverProblem:
    """Merge patches into rows and turn fractions into ticks.

    Raises
    ------
    RequirementError
        A fraction outside (0, 1], or a `seen_from` below 1.

    Notes
    -----
    Patches are distinguished by the 128-bit sum of a random number for each candidate that sees them: two different
    sets of candidates share one with odds of about R^2 / 2^129.
    """
    for constraint in constraints:
        if not 0.0 < constraint.fraction <= 1.0:
            raise RequirementError(
                f"coverage: got {constraint.fraction}, expected more than 0 and at most 1; e.g. 0.95"
            )
        if constraint.seen_from < 1:
            raise RequirementError(f"seen from: got {constraint.seen_from} stations, expected 1 or more; e.g. 1")
    row_of_patch, first = _merge(visibility, constraints)
    n_rows = first.size
    ticks_of_patch = np.rint(patch_area_m2 * TICKS_PER_M2).astype(np.int64)
    merged = row_of_patch >= 0
    ticks = np.zeros(n_rows, dtype=np.int64)
    np.add.at(ticks, row_of_patch[merged], ticks_of_patch[merged])
    n_patches = np.bincount(row_of_patch[merged], minlength=n_rows)
    # What fewer candidates see than a target asks for is not achievable: it counts for nothing.
    n_seers = visibility.n_seers()[first]
    counts_for = np.array(
        [constraint.part[first] & (n_seers >= constraint.seen_from) for constraint in constraints], dtype=bool
    )
    counts_for = counts_for.reshape(len(constraints), n_rows)
    required, least = np.zeros(len(constraints), dtype=np.int64), np.zeros(len(constraints), dtype=np.int64)
    for index, constraint in enumerate(constraints):
        whole = int(ticks[counts_for[index]].sum())
        # Half a tick of rounding a patch on either side: the fraction also holds of the unrounded areas.
        slack = int(n_patches[counts_for[index]].sum())
        exact = int(np.ceil(constraint.fraction * whole))
        required[index], least[index] = min(whole, exact + slack), max(0, exact - slack)
    starts, row = _merged_rows(visibility, row_of_patch, first, n_entries=int(n_seers.sum()))
    seen_from = np.array([constraint.seen_from for constraint in constraints], dtype=np.int64)
    return CoverProblem(starts, row, ticks, counts_for, required, least, seen_from)


def _merge(visibility: Visibility, constraints: tuple[Constraint, ...]) -> tuple[Int64Array, Int64Array]:
    """Row of every patch, -1 where nobody sees it or no target counts it; and the first patch of every row."""
    generator = np.random.default_rng(20230417)
    keys = np.zeros((2, visibility.n_patches), dtype=np.uint64)
    labels = [generator.integers(1, 2**63, size=visibility.n_positions, dtype=np.uint64) for _ in keys]
    seen = np.zeros(visibility.n_patches, dtype=bool)
    for at, patch in visibility.pieces():
        owner = visibility.positions_of(at, patch.size)
        seen[patch] = True
        for key, label in zip(keys, labels, strict=True):
            np.add.at(key, patch, label[owner])  # wraps around, as it may
    # Patches of one group are counted by the same targets. Renumbered at every step: bits of an integer run out.
    group = np.zeros(visibility.n_patches, dtype=np.int64)
    counted = np.zeros(visibility.n_patches, dtype=bool)
    for constraint in constraints:
        group = np.unique(group * 2 + constraint.part, return_inverse=True)[1].astype(np.int64)
        counted |= constraint.part
    used = np.flatnonzero(seen & counted)
    order = used[np.lexsort((used, group[used], keys[1, used], keys[0, used]))]
    new = np.ones(order.size, dtype=bool)
    new[1:] = (np.diff(keys[:, order].astype(np.uint64)) != 0).any(axis=0) | (np.diff(group[order]) != 0)
    # Rows are numbered by their first patch, so that numbers do not hang on the random ones.
    heads = order[new]
    rank = np.argsort(np.argsort(heads))
    row_of_patch = np.full(visibility.n_patches, -1, dtype=np.int64)
    row_of_patch[order] = rank[np.cumsum(new) - 1]
    return row_of_patch, np.sort(heads)


def _merged_rows(
    visibility: Visibility, row_of_patch: Int64Array, first: Int64Array, *, n_entries: int
) -> tuple[Int64Array, Int32Array]:
    """Candidates' rows, each once: all patches of a row are in exactly the same candidates, the first stands for it."""
    is_first = np.zeros(visibility.n_patches, dtype=bool)
    is_first[first] = True
    size = np.zeros(visibility.n_positions, dtype=np.int64)
    row = np.empty(n_entries, dtype=np.int32)  # filled piece by piece: put together from these, it would be there twice
    n_done = 0
    for at, patch in visibility.pieces():
        keep = is_first[patch]
        np.add.at(size, visibility.positions_of(at, patch.size)[keep], 1)
        n_kept = int(np.count_nonzero(keep))
        row[n_done : n_done + n_kept] = row_of_patch[patch[keep]]
        n_done += n_kept
    return np.concatenate([[0], np.cumsum(size)]).astype(np.int64), row
