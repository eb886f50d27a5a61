"""Selection with a bound: few stations, and how few are possible at best.

Input a `CoverProblem`, output a `ProvenSelection`: stations that meet every target, a lower bound that holds in exact
arithmetic, and whether both are the same. CONTROL FLOW, `select`:

1. leave out what cannot matter                                          reductions.py
2. greedy selection, connected where a network is required                  greedy.py, network.py
3. one station less, annealed, as long as that succeeds                   annealing.py
4. the linear relaxation by cutting planes, without the network, then with it                 relaxation.py
5. where parts of the network hardly see the same: a proof by such blocks  block_proof.py
6. in turns: branch and bound to raise the bound, longer annealing for one station less     branching.py
7. look at the result again by other means                                check.py

It stops when bound and stations meet, when the work allowed is done, or before where turns have long found nothing
more; work is counted, not timed, so that same problem and same settings give the same result on any machine. A limit of
time may be set besides; then they may not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import Int32Array, Proven
from planner_core.progress import BestSoFar, Progress, ProgressEvent, silent
from planner_core.select.block_proof import BlockProof
from planner_core.select.blocks import blocks_of
from planner_core.select.branching import BranchAndBound
from planner_core.select.check import check_selection
from planner_core.select.greedy import select_greedy
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem
from planner_core.select.quick_bound import counting_bound
from planner_core.select.reductions import Reduced, reduce_problem
from planner_core.select.search import ENOUGH, INTERRUPTED, PROVEN, WORK_DONE, Search, without_one

if TYPE_CHECKING:
    from planner_core.select.annealing import Annealer

__all__ = ["INTERRUPTED", "PROVEN", "ROUNDING", "Point", "ProvenSelection", "select"]

#: No smaller set meets `required`; one that meets `least` was not ruled out, and nothing is left to look at.
ROUNDING = "rounding of areas"

#: Steps of the first annealing for one station less, a candidate. It gets twice as many whenever it fails, and keeps
#: them where it succeeds: what is easy goes fast.
_FIRST_STEPS_A_CANDIDATE = 10
#: Once it has failed with as many, the bound has its turn.
_STEPS_BEFORE_BOUND = 80
#: From then on the proof gets so many times the work of annealing, the next one counted, which may be twice as long as
#: all before: what annealing has not found by then it rarely does.
_PROOF_SHARE = 3.0
#: A proof by blocks goes on before the whole has its turns, until its bound has not risen for so much of all work.
_BLOCK_PATIENCE_SHARE = 0.15
#: And gets so much at most.
_BLOCK_SHARE = 0.8
#: The root looks for separators of the network within the first of all work, so much of it.
_SWEEP_SHARE = 0.1
#: The turns end where so much work in a row, or this share of all that is allowed, has found neither fewer stations nor
#: a higher bound, and longer annealing finds none either. On duplex both were there after 13 s of selection; all the
#: rest of 150 units, 194 s, changed neither.
_PATIENCE, _PATIENCE_SHARE = 10.0, 1 / 15
#: The proof's turn lasts at least so long, in units of work.
_LEAST_TURN = 0.1
_MAX_STEPS = 2**28
_DEFAULTS = Proven()


@dataclass(frozen=True)
class Point:
    """What was known after `work`."""

    work: float
    stations: int
    bound: int


@dataclass(frozen=True)
class ProvenSelection:
    """chosen : candidates, forced ones first. lower_bound : no set that meets the targets has fewer. Of `select_large`
    with a network: none that is in no more of its parts, since fewest parts come first there.

    why_stopped : `proven`, `work limit`, `time limit`, `interrupted`, `as few as wanted` or `rounding of areas`, see
    `ROUNDING`. n_greedy :
    stations that greedy selection takes, with those that connect them where a network is required. curve : stations and
    bound after how much work; stations rise only for fewer parts, the bound never falls.
    """

    chosen: tuple[int, ...]
    lower_bound: int
    why_stopped: str
    work: float
    n_greedy: int
    curve: tuple[Point, ...] = field(repr=False)

    @property
    def proven(self) -> bool:
        """Whether no set of fewer stations meets the targets."""
        return self.lower_bound >= len(self.chosen)

    @property
    def gap(self) -> float:
        """Share of the stations that might be spared at most."""
        return 1.0 - self.lower_bound / len(self.chosen) if self.chosen else 0.0


def select(
    problem: CoverProblem,
    settings: Proven = _DEFAULTS,
    *,
    network: Network | None = None,
    given: Sequence[int] = (),
    start: Sequence[int] | None = None,
    enough: int = 0,
    progress: Progress = silent,
) -> ProvenSelection:
    """Find few candidates that meet every target, and a lower bound on how few could.

    Parameters
    ----------
    network
        The set has to be connected, see there; None: not required.
    given
        Candidates that are in the set anyway; they count.
    start
        Another set that meets the targets, such as one of a genetic search. The result is no larger than it (where it
        holds all of `given` and is connected), nor than that of greedy selection (where none are given, and no
        network required).
    enough
        A set of so many, or of fewer, ends the search: somebody knows that fewer are hardly to be found.
    progress
        A KeyboardInterrupt that it raises ends the search, not the call, once there is a set.

    Raises
    ------
    RequirementError
        `given` or `start` are no candidates, `start` misses a target, or the network is one of other candidates.
    SelectionCheckError
        The result is not what it should be: a fault of ours.

    Notes
    -----
    Sets are made for `problem.required`, the bound holds for `problem.least`: a proven set is the smallest for either.
    """
    if network is not None and network.n_candidates != problem.n_candidates:
        raise RequirementError(
            f"network: got one of {network.n_candidates} candidates, expected the problem's {problem.n_candidates}"
        )
    reduced = reduce_problem(problem, given=given, rows_only=network is not None)
    enough -= len(reduced.forced)
    search = _ProvenSearch(reduced, settings, network=network, enough=enough, progress=progress)
    search.begin(_known(problem, reduced, start))
    search.run_until_interrupted()
    try:
        return _checked(problem, search, network, given, start)
    except KeyboardInterrupt:  # the first one, or that of somebody in a hurry: what there is is ready in a moment
        search.limits.why_stopped = INTERRUPTED
        return _checked(problem, search, network, given, start)


def _checked(
    problem: CoverProblem,
    search: _ProvenSearch,
    network: Network | None,
    given: Sequence[int],
    start: Sequence[int] | None,
) -> ProvenSelection:
    result = search.result()
    if start is not None and (network is None or network.n_violations(list(dict.fromkeys(start))) == 0):
        result = _at_most(result, start, given)
    if search.n_candidates < problem.n_candidates and not given:
        # Greedy selection of what is left may go another way than that of the whole.
        result = _at_most(result, select_greedy(problem).chosen, given)
    check_selection(problem, result.chosen, given=given, network=network)
    return result


def _at_most(result: ProvenSelection, other: Sequence[int], given: Sequence[int]) -> ProvenSelection:
    """Return the other set in place of a larger one."""
    chosen = tuple(dict.fromkeys(other))
    if len(chosen) >= len(result.chosen) or not set(given) <= set(chosen):
        return result
    return replace(
        result,
        chosen=chosen,
        why_stopped=PROVEN if result.lower_bound >= len(chosen) else result.why_stopped,
        curve=(*result.curve, Point(result.work, len(chosen), result.lower_bound)),
    )


def _known(problem: CoverProblem, reduced: Reduced, start: Sequence[int] | None) -> list[int] | None:
    """Candidates of the reduced problem that `start` amounts to; None where it has some that were left out."""
    if start is None:
        return None
    if any(not 0 <= c < problem.n_candidates for c in start) or (problem.covered(list(start)) < problem.required).any():
        raise RequirementError(
            f"start of selection: got {len(start)} candidates that do not meet all targets, expected a set that does"
        )
    place = {int(c): i for i, c in enumerate(reduced.candidate)}
    return [place[c] for c in dict.fromkeys(start) if c in place]


def _find_in_block(
    settings: Proven,
    problem: CoverProblem,
    network: Network,
    pinned: tuple[int, ...],
    start: tuple[int, ...] | None,
    work: float,
    progress: Progress,
) -> tuple[tuple[int, ...], float]:
    """Few candidates of a block; see `planner_core.select.blocks.Find`."""
    settings = replace(settings, work_limit=work, prove=False)
    found = select(problem, settings, network=network, given=pinned, start=start, progress=progress)
    if found.why_stopped == INTERRUPTED:
        raise KeyboardInterrupt
    return found.chosen, found.work


class _ProvenSearch(Search):
    """One `select`, of the reduced problem. `_work` is that of annealing."""

    def __init__(
        self,
        reduced: Reduced,
        settings: Proven,
        *,
        network: Network | None,
        enough: int,
        progress: Progress,
    ) -> None:
        super().__init__(reduced.problem, settings, network=network, given=reduced.pinned, progress=progress)
        self._reduced, self._enough = reduced, enough
        self._annealing: Annealer | None = None
        self._round, self._n_steps = 0, _FIRST_STEPS_A_CANDIDATE * self._problem.n_candidates
        self._sets: Int32Array = np.zeros((0, 0), dtype=np.int32)
        self._tree: BranchAndBound | None = None
        self._blocks: BlockProof | None = None
        self._blocks_rose = 0, 0.0  # to which bound they did last, and after what work
        self._n_greedy = 0
        self._turns_from = 0.0  # work before the turns
        self._curve: list[Point] = []

    @property
    def n_candidates(self) -> int:
        """Number of those that are searched."""
        return self._problem.n_candidates

    # ------------------------------------------------------------------------------------------ the flow
    def begin(self, known: list[int] | None) -> None:
        """Take a first set; from here on there is a result."""
        greedy = select_greedy(self._problem, given=self._given, progress=self._progress).chosen
        self._best = self._fit(list(greedy))
        self._n_greedy = len(self._best)
        if known is not None and (self._problem.covered(known) >= self._problem.required).all():
            self._best = min(self._fit(known), self._best, key=len)  # of equals what somebody knows
        self._bound = min(counting_bound(self._problem) if (self._problem.least > 0).any() else 0, len(self._best))
        self._note()

    def run(self) -> None:
        """Improve set and bound until they meet or a limit is reached."""
        long = _STEPS_BEFORE_BOUND * self._problem.n_candidates
        while (self._n_steps <= long or not self._settings.prove) and self._can_anneal() and self._go_on():
            self._anneal()
        if not self._go_on() or not self._settings.prove:
            return
        self._tree = tree = BranchAndBound(
            self._problem,
            n_stations=len(self._best),
            lower_bound=self._bound,
            network=self._network,
            given=self._given,
        )
        tree.root(sweeping=_SWEEP_SHARE * self._settings.work_limit, progress=self._prove)
        self._take_from(tree)
        self._blocks = self._block_proof()
        self._turns_from = self._total_work()
        while self._go_on():
            patience = self._patience_left()
            if patience <= 0:
                if not self._anneal() and self._go_on():
                    self.limits.why_stopped = WORK_DONE
                    return
            elif self._blocks is not None and self._blocks_are_due(self._blocks, tree):
                self._blocks.advance(work=_LEAST_TURN, progress=self._report_blocks)
                self._take_from(self._blocks)
            elif tree.finished:
                self.limits.why_stopped = ROUNDING
                return
            elif self._proof_due(tree) > 0 or not self._anneal():
                tree.n_stations = len(self._best)
                due = min(self._proof_due(tree), patience)
                tree.advance(work=max(due, _LEAST_TURN), progress=self._prove)
                self._take_from(tree)

    def _patience_left(self) -> float:
        """Work that the turns may still do without finding anything."""
        patience = max(_PATIENCE, _PATIENCE_SHARE * self._settings.work_limit)
        return patience + max(self._turns_from, self._curve[-1].work) - self._total_work()

    def _block_proof(self) -> BlockProof | None:
        """Proof of what hardly see the same apart, where there are such blocks."""
        if self._network is None or not self._go_on():
            return None
        blocks = blocks_of(self._problem, self._network, self._given)
        if not blocks:
            return None
        return BlockProof(
            self._problem,
            blocks,
            n_stations=len(self._best),
            find=self._find,
            sent_find=partial(_find_in_block, replace(self._settings, time_limit_s=None)),
            work_limit=min(_BLOCK_SHARE * self._settings.work_limit, self._settings.work_limit - self._total_work()),
        )

    def _blocks_are_due(self, blocks: BlockProof, tree: BranchAndBound) -> bool:
        """Blocks go first as long as their bound rises."""
        patience, most = (share * self._settings.work_limit for share in (_BLOCK_PATIENCE_SHARE, _BLOCK_SHARE))
        if blocks.lower_bound > self._blocks_rose[0]:
            self._blocks_rose = blocks.lower_bound, blocks.work
        promise = tree.finished or blocks.work <= self._blocks_rose[1] + patience
        return promise and blocks.work < most and not blocks.finished

    def _find(self, *task: Any) -> tuple[tuple[int, ...], float]:
        """`_find_in_block` within the time that is left."""
        return _find_in_block(replace(self._settings, time_limit_s=self.limits.left_s), *task)

    def _report_blocks(self, event: ProgressEvent) -> None:
        """Report the whole instead of a block."""
        note = f"{len(self._best)} stations, at least {self._bound}, block by block"
        self._prove(replace(event, done=0, total=0, note=note))

    def _proof_due(self, tree: BranchAndBound) -> float:
        step_work = self._work_of_a_step(self._problem, self._network, len(self._best))
        next_work = 1e-9 * self._n_steps * step_work
        return _PROOF_SHARE * (self._work + next_work) - tree.work

    def result(self) -> ProvenSelection:
        """What was found so far."""
        for proof in (self._tree, self._blocks):
            if proof is not None:
                self._take_from(proof)
        forced = len(self._reduced.forced)
        last = self._curve[-1]
        if (last.stations, last.bound) != (len(self._best) + forced, self._bound + forced):
            self._note()  # an interrupt came between finding and noting
        return ProvenSelection(
            chosen=self._reduced.whole(self._best),
            lower_bound=self._bound + forced,
            why_stopped=self._why_stopped,
            work=self._total_work(),
            n_greedy=self._n_greedy + forced,
            curve=tuple(self._curve),
        )

    # ------------------------------------------------------------------------------------------- limits
    def _go_on(self) -> bool:
        if len(self._best) <= self._enough and not self._is_proven:
            self.limits.why_stopped = ENOUGH
            return False
        return super()._go_on()

    def _total_work(self) -> float:
        proofs = (proof.work for proof in (self._tree, self._blocks) if proof is not None)
        return self._work + sum(proofs)

    def _prove(self, event: ProgressEvent) -> None:
        """Pass progress of the proof on, and end it where a limit is reached."""
        self._progress(replace(event, best=self._best_so_far()))
        for proof in (self._tree, self._blocks):
            if proof is not None and self.limits.reached(self._total_work()):
                proof.stop()

    def _note(self) -> None:
        forced = len(self._reduced.forced)
        self._curve.append(Point(self._total_work(), len(self._best) + forced, self._bound + forced))

    def _best_so_far(self) -> BestSoFar:
        chosen = self._reduced.whole(self._best)
        return BestSoFar(len(chosen), self._bound + len(self._reduced.forced), chosen)

    # ------------------------------------------------------------------------------------------- the turns
    def _take_from(self, tree: BranchAndBound | BlockProof) -> None:
        """Keep what the proof found."""
        before = len(self._best), self._bound
        if tree.best is not None and len(tree.best) < len(self._best):
            self._best = self._fit(list(tree.best))
        self._bound = max(self._bound, min(tree.lower_bound, len(self._best)))
        if (len(self._best), self._bound) != before:
            self._note()

    def _anneal(self) -> bool:
        """Look for one station less, once; longer the next time if there is none."""
        if not self._can_anneal():
            return False
        if self._annealing is None:
            self._annealing = self._annealer(self._problem, self._network)
        if self._sets.shape != (self._settings.n_walks, len(self._best) - 1):
            self._sets = without_one(self._best, len(self._given), n_sets=self._settings.n_walks)
        self._round += 1
        step_work = self._work_of_a_step(self._problem, self._network, len(self._best))
        for done, missing in self._anneal_in_turns(
            self._annealing, self._sets, round_=self._round, n_steps=self._n_steps, step_work=step_work
        ):
            note = f"{len(self._best)} stations, trying one less"
            self._progress(ProgressEvent("select", done, self._n_steps, note, best=self._best_so_far()))
            met = np.flatnonzero(missing == 0)
            if met.size:
                self._best = self._fit([int(c) for c in self._sets[met[0]]])
                self._note()
                return True
            if not self._go_on():
                break
        self._n_steps = min(2 * self._n_steps, _MAX_STEPS)
        return False

    def _can_anneal(self) -> bool:
        """No set without candidates is annealed, nor one of pinned candidates alone."""
        return len(self._best) - 1 > len(self._given)
