"""The whole search: one trajectory on every device, in every form and on the host; what it keeps; when it stops."""

import numpy as np
import pytest
from slow_cases import all_slow_but

from planner_core.device import open_device
from planner_core.paper.genetic import GeneticSettings, on_device, select_genetic
from planner_core.paper.genetic.host import evolve_on_host
from planner_core.paper.genetic.objective import objective_of
from planner_core.paper.genetic.on_device import DEFAULT_SHAPE, WorkShape
from planner_core.progress import silent

BASE = {"population": 30, "n_parents": 20, "max_iterations": 25, "seed": 3}
WAYS = {
    "paper": {},
    "one-point": {"crossover": "one-point"},
    "uniform, elitist": {"crossover": "uniform", "selection": "elitist"},
    "generational": {"replacement": "generational", "individual_mutation_rate": 0.7},
    "generational with elite": {"replacement": "generational", "n_elite": 3, "crossover": "uniform"},
    "odd numbers": {"population": 31, "n_parents": 7, "tournament_size": 5},
    "generational, odd": {"replacement": "generational", "population": 31, "n_parents": 31, "n_elite": 2},
    "at most 5": {"objective": "coverage-at-most-n", "n_stations": 5, "expected_active": 4},
    "distinct": {"distinct": True, "gene_mutation_rate": 0.005},
    "eq9": {"objective": "eq9", "gene_mutation_rate": 0.3},
    "large seed": {"seed": 2**64 - 1, "expected_active": 1},
}

#: Stations of the best set after every iteration, and the last set, of `BASE` on problem 6.
EXPECTED_ACTIVE = [22] * 6 + [21, 20, 20] + [19] * 17
EXPECTED_CHOSEN = [0, 1, 3, 5, 6, 7, 8, 11, 12, 13, 14, 16, 19, 21, 23, 27, 31, 32, 34]


def same(a, b):
    """All results are equal, bit for bit."""
    assert a.chosen.tolist() == b.chosen.tolist()
    for name in ("key_by_iteration", "covered_by_iteration", "active_by_iteration"):
        assert getattr(a, name).tolist() == getattr(b, name).tolist(), name
    assert (a.n_evaluations, a.why_stopped) == (b.n_evaluations, b.why_stopped)


@pytest.mark.parametrize("way", all_slow_but((way for way in WAYS if way != "paper"), WAYS))
def test_device_and_host_take_the_same_trajectory(make_problem, device, way):
    problem = make_problem(1)
    chosen = GeneticSettings(**(BASE | WAYS[way]))
    same(select_genetic(problem, chosen, device=device), select_genetic(problem, chosen, engine="host"))


@pytest.mark.slow
@pytest.mark.parametrize("n_candidates", [1, 2, 31, 32, 33, 65])
def test_device_and_host_agree_for_any_number_of_candidates(make_problem, device, n_candidates):
    problem = make_problem(2, n_candidates=n_candidates, n_patches=60, density=0.5)
    for crossover in ("one-point", "two-point", "uniform"):
        chosen = GeneticSettings(**BASE, crossover=crossover, individual_mutation_rate=0.5)
        same(select_genetic(problem, chosen, device=device), select_genetic(problem, chosen, engine="host"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "shape",
    [DEFAULT_SHAPE, WorkShape(4, 4, 2, 5, 3), WorkShape(8, 1, 1, 1, 1), WorkShape(1, 3, 5, 0, 2)],
    ids=lambda shape: str(shape),
)
def test_trajectory_does_not_depend_on_how_work_is_cut(make_problem, device, monkeypatch, shape):
    problem, chosen = make_problem(3), GeneticSettings(**BASE)
    usual = select_genetic(problem, chosen, device=device)
    monkeypatch.setitem(on_device.SHAPES, device.kind, shape)
    same(usual, select_genetic(problem, chosen, device=device))


@pytest.mark.slow
def test_trajectory_is_the_same_in_the_form_for_gpus(make_problem, device):
    problem, chosen = make_problem(3), GeneticSettings(**BASE)
    as_gpu = open_device()
    as_gpu.kind = "gpu"
    same(select_genetic(problem, chosen, device=device), select_genetic(problem, chosen, device=as_gpu))


@pytest.mark.slow
@pytest.mark.parametrize("n_threads", [1, 3])
def test_trajectory_does_not_depend_on_the_number_of_threads(make_problem, n_threads):
    problem, chosen = make_problem(4), GeneticSettings(**BASE)
    usual = select_genetic(problem, chosen, engine="host")
    given = np.zeros((0, 40), dtype=bool)
    objective = objective_of(problem, chosen)
    again = evolve_on_host(problem, chosen, objective, given, progress=silent, n_threads=n_threads)
    assert again.history[:, 0].tolist() == usual.key_by_iteration.tolist()


@pytest.mark.parametrize("look", [1, pytest.param(7, marks=pytest.mark.slow)])
def test_trajectory_does_not_depend_on_how_often_the_host_looks(make_problem, device, monkeypatch, look):
    problem, chosen = make_problem(5), GeneticSettings(**BASE)
    usual = select_genetic(problem, chosen, device=device)
    monkeypatch.setattr(on_device, "GENERATIONS_A_LOOK", look)
    same(usual, select_genetic(problem, chosen, device=device))


@pytest.mark.parametrize("engine", ["host", "device"])
def test_fixed_seed_gives_a_fixed_trajectory(make_problem, engine):
    result = select_genetic(make_problem(6), GeneticSettings(**BASE), engine=engine)
    assert result.active_by_iteration.tolist() == EXPECTED_ACTIVE
    assert result.chosen.tolist() == EXPECTED_CHOSEN


def test_other_seed_gives_another_trajectory(make_problem, device):
    problem = make_problem(6)
    one = select_genetic(problem, GeneticSettings(**BASE), device=device)
    other = select_genetic(problem, GeneticSettings(**(BASE | {"seed": 4})), device=device)
    assert one.key_by_iteration.tolist() != other.key_by_iteration.tolist()


@pytest.mark.parametrize("way", WAYS)
def test_best_so_far_never_gets_worse_and_is_what_it_says(make_problem, way):
    """On the host: the device takes the same trajectory."""
    problem = make_problem(7)
    result = select_genetic(problem, GeneticSettings(**(BASE | WAYS[way])), engine="host")
    assert (np.diff(result.key_by_iteration) >= 0).all()
    assert result.active_by_iteration[-1] == result.chosen.size
    seen = np.zeros(problem.n_rows, dtype=bool)
    for candidate in result.chosen:
        seen[problem.rows_of(candidate)] = True
    assert result.covered_by_iteration[-1] == problem.ticks[seen].sum()
    assert (np.diff(result.chosen) > 0).all()


@pytest.mark.parametrize("engine", ["host", "device"])
def test_search_stops_after_the_iterations_without_improvement(make_problem, engine):
    result = select_genetic(
        make_problem(8), GeneticSettings(population=30, n_parents=20, patience=6, seed=1), engine=engine
    )
    assert result.why_stopped == "no improvement"
    last_gain = int(np.flatnonzero(np.diff(result.key_by_iteration))[-1]) + 1
    assert result.iterations == last_gain + 6
    # Nowhere before were there six without any.
    gains = np.concatenate([[0], np.flatnonzero(np.diff(result.key_by_iteration)) + 1])
    assert np.diff(gains).max() < 6 + 1


@pytest.mark.parametrize("engine", ["host", "device"])
@pytest.mark.parametrize("n", [0, 1, 16, 17])
def test_search_stops_at_the_greatest_number_of_iterations(make_problem, engine, n):
    chosen = GeneticSettings(population=30, n_parents=20, max_iterations=n, patience=1000)
    result = select_genetic(make_problem(8), chosen, engine=engine)
    assert (result.iterations, result.why_stopped) == (n, "iterations")
    assert result.n_evaluations == 30 + 20 * n


@pytest.mark.parametrize("engine", ["host", "device"])
def test_progress_hears_of_every_iteration_once(make_problem, engine):
    heard = []
    chosen = GeneticSettings(**(BASE | {"max_iterations": 20}))
    result = select_genetic(make_problem(9), chosen, engine=engine, progress=heard.append)
    assert [event.done for event in heard] == list(range(result.iterations + 1))
    assert heard[-1].note == f"{result.chosen.size} stations"


@pytest.mark.opencl
def test_error_of_the_progress_ends_the_search_and_gives_the_memory_back(make_problem):
    own = open_device()

    def stop(event):
        if event.done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        select_genetic(make_problem(9), GeneticSettings(**BASE), device=own, progress=stop)
    assert own.held_bytes == 0
    assert select_genetic(make_problem(9), GeneticSettings(**BASE), device=own).chosen.size
    assert own.held_bytes == 0


@pytest.mark.parametrize("engine", ["host", "device"])
def test_given_sets_are_in_the_first_population(make_problem, engine):
    problem = make_problem(10)
    everything = np.arange(40)
    chosen = GeneticSettings(population=4, n_parents=2, max_iterations=0, expected_active=1)
    result = select_genetic(problem, chosen, engine=engine, given=[everything, everything[::-1], everything])
    # Nobody else of so few meets the targets.
    assert result.chosen.tolist() == everything.tolist()
