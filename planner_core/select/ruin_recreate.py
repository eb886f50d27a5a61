"""Ruin and recreate: local search of sets that meet all targets and are connected at every step, compiled.

Input a `CoverProblem`, a `Network` or none, and a set that meets all and is connected; output one with no more
components and no more stations, by as many tries as required. Fewest components come first, then fewest stations,
then most that is covered beyond the requirements; but there are never more stations than are allowed.

A try takes out stations that see the same surfaces, one after the other (Schrimpf et al. 2000; Shaw 1998). It takes in
candidates by what they see that is missing, until all targets are met: fully, if they are linked to the set; less, if
they have to be joined; those of parts that the set has nobody in only if no others help. It joins what came apart, by
shortest ways, and takes out what is spare. What is better stays; so does what has as many stations and has lost little.

What each candidate adds, and what each station alone sees, is kept up to date, row by row. All is whole numbers, with
random numbers by counter: every machine goes the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planner_core.compiled import compiled
from planner_core.select.bit_rows import classes_of
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

#: Stations that a try takes out: from two to so many.
_MOST_OUT = 12
#: What a set of equal size may lose, against the best of that size: a share of what a candidate sees in the mean.
_LOSS_DIVISOR = 2
#: Numbers are read in no order that memory likes: 1e9 take about as many seconds of one core.
_WORK_OF_A_NUMBER = 1.8e-9


class RuinRecreate:
    """The state of one search; `chosen` is the best set so far, `work` about the seconds of one core, counted.

    most : stations that a set with fewer components may have; as many as `chosen` has by default.
    """

    def __init__(
        self,
        problem: CoverProblem,
        chosen: Sequence[int],
        *,
        network: Network | None = None,
        given: Sequence[int] = (),
        most: int | None = None,
        seed: int = 0,
    ) -> None:
        n, r = problem.n_candidates, problem.n_rows
        if (problem.seen_from > 1).any() or (network is not None and network.loops):
            raise ValueError("ruin and recreate: got several looks or loops, expected neither")
        class_of, counts = classes_of(problem)
        seer_starts, seer = problem.seers()
        none = np.zeros(n + 1, dtype=np.int64)
        self.work = 0.0
        self._given, self._best = list(given), list(chosen)
        self._counter = 0
        self._fixed: tuple[Any, ...] = (
            problem.starts,
            problem.row,
            seer_starts,
            seer,
            class_of,
            problem.ticks,
            np.ascontiguousarray(counts, dtype=np.int64),  # another layout would be compiled for anew, for seconds
            problem.required,
            none if network is None else network.starts.astype(np.int64),
            np.zeros(0, dtype=np.int32) if network is None else network.neighbour,
            np.arange(n) if network is None else network.part.astype(np.int64),
            network is not None,
            np.uint64(seed),
            max(int(problem.ticks @ np.diff(seer_starts)) // max(n, 1) // _LOSS_DIVISOR, 1),
            len(chosen) if most is None else most,
        )
        held = np.zeros(n, dtype=np.uint8)
        held[self._given] = 1
        n_classes = counts.shape[1]
        #: Looks at rows, sums of who looks, what candidates add and stations alone see by class, what is covered by
        #: class, chosen ones, given ones, linked chosen ones, chosen ones a part.
        self._state: tuple[Any, ...] = (
            np.zeros(r, dtype=np.int32),
            np.zeros(r, dtype=np.int64),
            np.zeros((n, n_classes), dtype=np.int64),
            np.zeros((n, n_classes), dtype=np.int64),
            np.zeros(n_classes, dtype=np.int64),
            np.zeros(n, dtype=np.uint8),
            held,
            np.zeros(n, dtype=np.int32),
            np.zeros(int(self._fixed[10].max(initial=-1)) + 1, dtype=np.int64),
        )
        for candidate in range(n):
            rows = problem.rows_of(candidate)
            np.add.at(self._state[2][candidate], class_of[rows], problem.ticks[rows])
        self._begin()

    @property
    def chosen(self) -> list[int]:
        """The best set, given ones first."""
        return [*self._given, *(c for c in self._best if c not in set(self._given))]

    def tries(self, n: int) -> bool:
        """Go on with `n` tries; say whether the best set became a better one. No more and no fewer are ever done."""
        best = np.zeros(self._state[5].size, dtype=np.uint8)
        words: list[Any] = [*self._fixed, *self._state, self._counter, n, best, self._spare]
        better, touched = _search(*words)
        self._counter += n
        self.work += _WORK_OF_A_NUMBER * touched
        if better:
            self._best = np.flatnonzero(best).tolist()
        return bool(better)

    def _begin(self) -> None:
        self._spare = np.full(1, np.iinfo(np.int64).min)
        for candidate in self._best:
            words: list[Any] = [*self._fixed[:6], *self._fixed[8:11], *self._state[:6], *self._state[7:]]
            _change(*[*words, candidate, True])


@compiled
def _draw(seed: Any, counter: int, number: int) -> Any:
    """A random number below 2^63 (splitmix64, Steele et al. 2014)."""
    x = seed + np.uint64(counter) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(number) * np.uint64(0xD1B54A32D192ED03)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.int64((x ^ (x >> np.uint64(31))) >> np.uint64(1))


@compiled
def _change(
    starts: Any, row: Any, seer_starts: Any, seer: Any, class_of: Any, ticks: Any, link_starts: Any, link: Any,
    part: Any, looks: Any, lookers: Any, adds: Any, alone: Any, covered: Any, inside: Any, n_linked: Any,
    n_in_part: Any, candidate: int, comes: bool,
) -> Any:  # fmt: skip
    """Let a candidate come or go, and return how many numbers that took."""
    touched = starts[candidate + 1] - starts[candidate]
    for e in range(starts[candidate], starts[candidate + 1]):
        r = row[e]
        c, t = class_of[r], ticks[r]
        if comes:
            if looks[r] == 1:
                alone[lookers[r], c] -= t
            looks[r] += 1
            lookers[r] += candidate
            if looks[r] != 1:
                continue
            alone[candidate, c] += t
            t = -t
        else:
            looks[r] -= 1
            lookers[r] -= candidate
            if looks[r] == 1:
                alone[lookers[r], c] += t
            if looks[r] != 0:
                continue
            alone[candidate, c] -= t
        covered[c] -= t
        touched += seer_starts[r + 1] - seer_starts[r]
        for f in range(seer_starts[r], seer_starts[r + 1]):
            adds[seer[f], c] += t
    step = 1 if comes else -1
    inside[candidate] = comes
    n_in_part[part[candidate]] += step
    for e in range(link_starts[candidate], link_starts[candidate + 1]):
        n_linked[link[e]] += step
    return touched + link_starts[candidate + 1] - link_starts[candidate]


@compiled
def _label(link_starts: Any, link: Any, members: Any, inside: Any, label: Any, queue: Any, left_out: int) -> Any:
    """Number the components of the members that are inside, but for one; return how many there are."""
    for i in members:
        label[i] = -1
    n = 0
    for root in members:
        if inside[root] == 0 or label[root] >= 0 or root == left_out:
            continue
        label[root] = n
        queue[0] = root
        head, tail = 0, 1
        while head < tail:
            at = queue[head]
            head += 1
            for e in range(link_starts[at], link_starts[at + 1]):
                other = link[e]
                if inside[other] != 0 and label[other] < 0 and other != left_out:
                    label[other] = n
                    queue[tail] = other
                    tail += 1
        n += 1
    return n


@compiled
def _way(
    link_starts: Any, link: Any, inside: Any, label: Any, adds: Any, before: Any, queue: Any, chosen: Any, source: int
) -> Any:  # fmt: skip
    """Candidate next to another component, on a shortest way from component `source`; `before` leads back; -1: none."""
    before[:] = -2
    head, tail = 0, 0
    for i in chosen:
        if label[i] == source:
            queue[tail] = i
            tail += 1
            before[i] = -1
    first_end = tail
    best, most, stop = -1, -1, -1
    while head < tail:
        if head == stop:
            break
        at = queue[head]
        head += 1
        for e in range(link_starts[at], link_starts[at + 1]):
            other = link[e]
            if inside[other] != 0:
                if label[other] != source and inside[at] == 0:
                    worth = adds[at].sum()
                    if worth > most:
                        best, most = at, worth
                    if stop < 0:
                        stop = first_end  # all others of this distance may do, too
            elif before[other] == -2:
                before[other] = at
                queue[tail] = other
                tail += 1
        if head == first_end:
            first_end = tail
    return best


@compiled
def _missing(counts: Any, required: Any, covered: Any, missing: Any) -> Any:
    """Ticks that each target misses; return all of them together."""
    total = 0
    for k in range(required.size):
        left = required[k]
        for c in range(covered.size):
            left -= counts[k, c] * covered[c]
        missing[k] = left
        total += max(left, 0)
    return total


@compiled
def _search(
    starts: Any, row: Any, seer_starts: Any, seer: Any, class_of: Any, ticks: Any, counts: Any, required: Any,
    link_starts: Any, link: Any, part: Any, has_network: bool, seed: Any, loss: int, n_most: int,
    looks: Any, lookers: Any, adds: Any, alone: Any, covered: Any, inside: Any, held: Any, n_linked: Any,
    n_in_part: Any, counter: int, n_tries: int, best: Any, best_spare: Any,
) -> Any:  # fmt: skip
    """Tries `counter` .. `counter + n_tries - 1`. best : (N,), written where a better set was found.

    best_spare : (1,), the most that a set of the best size covers beyond the requirements; read and written.
    """
    n, n_classes, n_targets = inside.size, covered.size, required.size
    missing = np.zeros(n_targets, dtype=np.int64)
    label, before, queue = np.full(n, -1), np.full(n, -2), np.zeros(n + 1, dtype=np.int64)
    excluded = np.zeros(n, dtype=np.uint8)
    log = np.zeros(4 * n + 64, dtype=np.int64)
    n_set: Any = 0
    n_parts: Any = 0
    touched: Any = 0
    better = False
    for i in range(n):
        n_set += inside[i]
    for q in range(n_in_part.size):
        n_parts += n_in_part[q] > 0
    for number in range(counter, counter + n_tries):
        chosen: Any = np.flatnonzero(inside)
        n_log, draw = 0, 1
        # 1. Some that see the same go: from one to the next by a surface that both see, or by a link.
        n_out = 2 + _draw(seed, number, 0) % (_MOST_OUT - 1)
        for _ in range(3 * n_out):
            if n_log == n_out:
                break
            if n_log == 0:
                out = chosen[_draw(seed, number, draw) % chosen.size]
            else:
                origin = log[_draw(seed, number, draw) % n_log] - 1
                out = -1
                own = starts[origin + 1] - starts[origin]
                n_links = link_starts[origin + 1] - link_starts[origin]
                if own > 0 and (n_links == 0 or _draw(seed, number, draw + 1) % 4 != 0):
                    r = row[starts[origin] + _draw(seed, number, draw + 2) % own]
                    first, size = seer_starts[r], seer_starts[r + 1] - seer_starts[r]
                else:
                    first, size = link_starts[origin], n_links
                begin = _draw(seed, number, draw + 3) % size if size > 0 else 0
                for step in range(size):
                    e = first + (begin + step) % size
                    other = seer[e] if size != n_links or first != link_starts[origin] else link[e]
                    if inside[other] != 0:
                        out = other
                        break
            draw += 4
            if out < 0 or held[out] != 0 or inside[out] == 0:
                continue
            touched += _change(
                starts, row, seer_starts, seer, class_of, ticks, link_starts, link, part, looks, lookers, adds,
                alone, covered, inside, n_linked, n_in_part, out, False,
            )  # fmt: skip
            log[n_log] = out + 1
            n_log += 1
            excluded[out] = _draw(seed, number, draw) % 2
        n_gone, n_now = n_log, n_set - n_log
        noise = _draw(seed, number, draw + 1) % 4  # of 16: how much of what a candidate adds is left to chance
        salt = _draw(seed, number, draw + 2)
        # 2. Those that add most come, until all targets are met.
        while _missing(counts, required, covered, missing) > 0 and n_now <= n_set:
            into, most = -1, 0
            for leave in range(3):  # who has just gone and new parts, then the former alone, then nobody is left aside
                for i in range(n):
                    if inside[i] != 0 or (excluded[i] != 0 and leave < 2):
                        continue
                    new_part = has_network and n_in_part[part[i]] == 0
                    if new_part and leave == 0:
                        continue
                    worth = 0
                    for k in range(n_targets):
                        if missing[k] > 0:
                            own_worth = 0
                            for c in range(n_classes):
                                own_worth += counts[k, c] * adds[i, c]
                            worth += min(own_worth, missing[k])
                    if worth == 0:
                        continue
                    if has_network and n_linked[i] == 0:
                        worth -= worth // 2 - worth // 8
                    if noise > 0:
                        worth -= (worth // 2048) * noise * (((i * 0x9E3779B1) ^ salt) >> 7 & 127)
                    if worth > most:
                        into, most = i, worth
                touched += n * n_classes
                if into >= 0:
                    break
            if into < 0:
                break
            touched += _change(
                starts, row, seer_starts, seer, class_of, ticks, link_starts, link, part, looks, lookers, adds,
                alone, covered, inside, n_linked, n_in_part, into, True,
            )  # fmt: skip
            log[n_log] = -into - 1
            n_log += 1
            n_now += 1
        for q in range(n_gone):
            excluded[log[q] - 1] = 0
        done = _missing(counts, required, covered, missing) <= 0
        # 3. What came apart is joined.
        while done and has_network and n_now <= n_set + 2:
            chosen = np.flatnonzero(inside)
            n_components = _label(link_starts, link, chosen, inside, label, queue, -1)
            touched += 16 * chosen.size
            first_of: Any = np.full(n_in_part.size, -1)
            source: Any = -1
            size = np.zeros(n_components, dtype=np.int64)
            for i in chosen:
                size[label[i]] += 1
            for i in chosen:  # the smallest of a part that is in several
                q = part[i]
                if first_of[q] < 0:
                    first_of[q] = label[i]
                elif first_of[q] != label[i]:
                    small: Any = label[i] if size[label[i]] < size[first_of[q]] else first_of[q]
                    if source < 0 or size[small] < size[source]:
                        source = small
            if source < 0:
                break
            at = _way(link_starts, link, inside, label, adds, before, queue, chosen, source)
            touched += n
            if at < 0:
                done = False
                break
            while at >= 0 and inside[at] == 0:
                touched += _change(
                    starts, row, seer_starts, seer, class_of, ticks, link_starts, link, part, looks, lookers, adds,
                    alone, covered, inside, n_linked, n_in_part, at, True,
                )  # fmt: skip
                log[n_log] = -at - 1
                n_log += 1
                n_now += 1
                at = before[at]
        done = done and n_now <= n_set + 2
        # 4. What is spare goes: what sees least alone first.
        while done:
            _missing(counts, required, covered, missing)
            chosen = np.flatnonzero(inside)
            loose, losses = np.zeros(chosen.size, dtype=np.int64), np.zeros(chosen.size, dtype=np.int64)
            n_loose = 0
            for i in chosen:
                if held[i] != 0:
                    continue
                fits, own = True, 0
                for k in range(n_targets):
                    own_k = 0
                    for c in range(n_classes):
                        own_k += counts[k, c] * alone[i, c]
                    own += own_k
                    fits = fits and own_k <= -missing[k]
                if fits:
                    loose[n_loose], losses[n_loose] = i, own
                    n_loose += 1
            out = -1
            order = np.argsort(losses[:n_loose], kind="mergesort")
            n_components = -1
            for q in order:
                i = loose[q]
                if not has_network or n_in_part[part[i]] == 1 or n_linked[i] <= 1:
                    out = i
                    break
                if n_components < 0:
                    n_components = _label(link_starts, link, chosen, inside, label, queue, -1)
                touched += 16 * chosen.size
                if _label(link_starts, link, chosen, inside, label, queue, i) <= n_components:
                    out = i
                    break
            if out < 0:
                break
            touched += _change(
                starts, row, seer_starts, seer, class_of, ticks, link_starts, link, part, looks, lookers, adds,
                alone, covered, inside, n_linked, n_in_part, out, False,
            )  # fmt: skip
            log[n_log] = out + 1
            n_log += 1
            n_now -= 1
        # 5. What is better stays.
        now_parts = 0
        if has_network:
            for q in range(n_in_part.size):
                now_parts += n_in_part[q] > 0
        else:
            now_parts = n_parts
        spare = 0
        if done:
            _missing(counts, required, covered, missing)
            spare = -missing.sum()
        fewer = done and n_now <= n_most and (now_parts < n_parts or (now_parts == n_parts and n_now < n_set))
        as_many = done and now_parts == n_parts and n_now == n_set and spare >= best_spare[0] - loss
        if fewer:
            n_set, n_parts, better = n_now, now_parts, True
            best_spare[0] = spare
            best[:] = inside
        elif as_many:
            best_spare[0] = max(best_spare[0], spare)
        else:
            for q in range(n_log - 1, -1, -1):
                touched += _change(
                    starts, row, seer_starts, seer, class_of, ticks, link_starts, link, part, looks, lookers, adds,
                    alone, covered, inside, n_linked, n_in_part, abs(log[q]) - 1, log[q] > 0,
                )  # fmt: skip
    return better, touched
