"""What annealing works with: a problem, its nearest candidates, and tables of temperatures and of what is accepted.

Input a `CoverProblem`, output an `AnnealingProblem` for `planner_core.select.annealing`, whose docstring has the rule.
Nothing here needs numba, which takes a while to import.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner_core.model import Int32Array, Int64Array
from planner_core.select.bit_rows import classes_of
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

#: Candidates that a step of annealing tries for the place of one station, so that taking it out serves more than one.
TRIES = 4
#: Candidates that see most nearly the same, for which a station is exchanged three times of four.
N_NEAR = 24
#: Rows from which it is computed how much two candidates share.
_SAMPLE_ROWS = 2048
#: Temperature at the start, as a share of what a candidate sees in the mean, and the ratio of one of N_TEMPERATURES to
#: the one before, in 2^-16: it ends at a fiftieth. Starts or ends several times as hot or cold cost stations.
_FIRST_TEMPERATURE_DIVISOR = 20
_TEMPERATURE_RATIO = 64538
N_TEMPERATURES = 256
#: Penalty of each violation of the network, as a share of what a candidate sees in the mean: a fifth. With an eightieth
#: sets come apart faster than they are connected.
_PENALTY_DIVISOR = 5
#: Bits of a random number that choose an entry of the acceptance table.
ACCEPTANCE_BITS = 12


class AnnealingProblem:
    """What annealing knows of a problem.

    class_of : (R,) int32, rows that the same constraints count are of one class. counts : (K, classes) bool, constraint
    k counts class c. nearest : see `nearest_candidates`. penalty : ticks of one of `Network.n_violations`.
    """

    def __init__(self, problem: CoverProblem, *, seed: int, network: Network | None = None) -> None:
        class_of, counts = classes_of(problem)
        self.problem, self.seed, self.network = problem, seed, network
        self.n_levels = int(problem.seen_from.max(initial=1))
        self.class_of = class_of.astype(np.int32)
        self.counts = counts.astype(bool)
        self.nearest = nearest_candidates(problem, N_NEAR)
        self.acceptance = acceptance_table()
        seen_ticks = int(problem.ticks[problem.row].sum())
        mean_ticks = seen_ticks // max(problem.n_candidates, 1)
        self.temperature = temperatures(mean_ticks)
        self.penalty = max(mean_ticks // _PENALTY_DIVISOR, 1)


def acceptance_table() -> NDArray[np.uint32]:
    """(4096,) uint32: quantiles of the exponential distribution at evenly spaced probabilities, in units of 2^-16."""
    n = 1 << ACCEPTANCE_BITS
    return np.array([round(-math.log((i + 0.5) / n) * 65536) for i in range(n)], dtype=np.uint32)


def temperatures(mean_ticks: int) -> Int64Array:
    """(N_TEMPERATURES,) int64, ticks: a geometric sequence, in whole numbers."""
    falling = [mean_ticks // _FIRST_TEMPERATURE_DIVISOR]
    for _ in range(N_TEMPERATURES - 1):
        falling.append(falling[-1] * _TEMPERATURE_RATIO >> 16)
    return np.array(falling, dtype=np.int64)


def nearest_candidates(problem: CoverProblem, n_near: int) -> Int32Array:
    """(N, M) int32, M = min(n_near, N - 1): candidates that share the greatest part of what either sees, best first.

    Judged by a sample of rows, evenly spread; ties go to the lower number. Sums of zeros and ones are exact in float32,
    so that the order of summing does not matter.
    """
    n, m = problem.n_candidates, min(n_near, problem.n_candidates - 1)
    if m < 1:
        return np.zeros((n, 0), dtype=np.int32)
    n_sample = min(_SAMPLE_ROWS, problem.n_rows)
    sample = np.arange(n_sample) * problem.n_rows // max(n_sample, 1)
    place = np.full(problem.n_rows, -1)
    place[sample] = np.arange(n_sample)
    owner = np.repeat(np.arange(n), np.diff(problem.starts))
    kept = place[problem.row] >= 0
    sees = np.zeros((n, n_sample), dtype=np.float32)
    sees[owner[kept], place[problem.row[kept]]] = 1.0
    size = sees.sum(axis=1)
    near = np.empty((n, m), dtype=np.int32)
    for begin in range(0, n, 512):
        shared = sees[begin : begin + 512] @ sees.T
        part = shared / np.maximum(size[begin : begin + 512, None] + size[None] - shared, 1.0)
        part[np.arange(part.shape[0]), begin + np.arange(part.shape[0])] = -1.0
        near[begin : begin + 512] = np.argsort(-part, axis=1, kind="stable")[:, :m]
    return near
