"""Options of a method by name: every field can be set, and everything else is refused in one line."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from planner_core.errors import RequirementError
from planner_core.model import Greedy, Method, Paper, Proven
from planner_core.model.methods import GeneticSettings
from planner_core.model.options import method_of, option_list, options_of, with_options
from planner_core.model.spatial_search import SearchSettings


@dataclass(frozen=True)
class Inner:
    steps: int = 3
    at_m: tuple[float, float] = (0.0, 1.0)
    limit: float | None = None
    origin_m: tuple[float, float] | None = None


@dataclass(frozen=True)
class Outer:
    word: str = "a"
    on: bool = False
    length_m: float = 0.5
    inner: Inner = field(default_factory=Inner)


def test_options_are_read_as_the_types_of_their_fields() -> None:
    options = [("word", "b"), ("on", "yes"), ("length_m", "2"), ("inner.steps", "7"), ("inner.at_m", "1,2.5")]
    assert with_options(Outer(), [*options, ("inner.limit", "4")]) == Outer("b", True, 2.0, Inner(7, (1.0, 2.5), 4.0))
    assert with_options(Outer(inner=Inner(limit=1.0)), []) == Outer(inner=Inner(limit=1.0))
    assert with_options(Outer(), [("inner.limit", "none")]).inner.limit is None
    assert with_options(Outer(), [("inner.origin_m", "3,4")]).inner.origin_m == (3.0, 4.0)
    assert with_options(Outer(inner=Inner(limit=1.0)), [("inner.origin_m", "none")]).inner.origin_m is None


def test_options_are_listed_by_the_names_they_are_set_by() -> None:
    names = [name for name, _ in option_list(Outer())]
    assert names == ["word", "on", "length_m", "inner.steps", "inner.at_m", "inner.limit", "inner.origin_m"]


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("inner.stepz", "1"), "option inner.stepz: there is none of that name, perhaps inner.steps"),
        (("inner", "1"), "option inner: there is none of that name"),
        (("word.x", "1"), "option word.x: there is none of that name"),
        (("zzzz", "1"), "expected one of word, on"),
        (("on", "maybe"), "option on: got 'maybe', expected yes or no; the default is False"),
        (("inner.steps", "1.5"), "option inner.steps: got '1.5', expected a whole number"),
        (("length_m", "long"), "option length_m: got 'long', expected a number"),
        (("inner.at_m", "1,x"), "option inner.at_m: got '1,x', expected numbers"),
        (("inner.origin_m", "x"), "option inner.origin_m: got 'x', expected numbers"),
        (("inner.limit", "1,2"), "option inner.limit: got '1,2', expected a number"),
    ],
)
def test_options_that_make_no_sense_are_refused_in_one_line(option: tuple[str, str], message: str) -> None:
    with pytest.raises(RequirementError) as refusal:
        with_options(Outer(), [option])
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_an_option_given_twice_is_refused() -> None:
    with pytest.raises(RequirementError, match="option word: got 'b' and 'c', expected it once"):
        with_options(Outer(), [("word", "b"), ("word", "c")])


def test_defaults_of_the_pipeline_are_those_of_the_papers_tables() -> None:
    values = dict(option_list(Paper()))
    table_1 = {"max_iterations": 60, "max_without_improvement": 10, "n_directions": 16, "step_m": 0.05}
    table_1 |= {"initial_temperature": 450.0, "cooling": 0.8}
    for name, value in table_1.items():
        assert values[f"spatial.{name}"] == value
    table_3 = {"max_iterations": 50_000, "population": 500, "n_parents": 250, "gene_mutation_rate": 0.02}
    table_3 |= {"individual_mutation_rate": 0.1, "crossover_rate": 0.8, "patience": 30, "crossover": "two-point"}
    table_3 |= {"selection": "tournament", "tournament_size": 2, "replacement": "stationary"}
    for name, value in table_3.items():
        assert values[f"genetic.{name}"] == value


def test_an_origin_of_too_few_numbers_is_refused() -> None:
    assert with_options(Paper(), [("spatial.lattice_origin_m", "1,2,3")]).spatial.lattice_origin_m == (1, 2, 3)
    with pytest.raises(RequirementError, match=r"lattice_origin_m: got .*, expected three finite metres"):
        with_options(Paper(), [("spatial.lattice_origin_m", "1")])


@pytest.mark.parametrize(
    ("method", "options"),
    [
        (Greedy(), {}),
        (Proven(), {}),
        (Proven(work_limit=2), {"work_limit": "2"}),
        (
            Proven(work_limit=0.1, time_limit_s=30.0, seed=0, prove=False),
            {"work_limit": "0.1", "time_limit_s": "30", "seed": "0", "prove": "no"},
        ),
        (
            Paper(
                search="ls",
                spatial=SearchSettings(max_iterations=5, fixed_height=True, lattice_origin_m=(1, 2.5, -3)),
                genetic=GeneticSettings(seed=2**63),
            ),
            {
                "search": "ls",
                "spatial.max_iterations": "5",
                "spatial.fixed_height": "yes",
                "spatial.lattice_origin_m": "1,2.5,-3",
                "genetic.seed": str(2**63),
            },
        ),
    ],
)
def test_a_method_is_written_as_the_options_that_make_it(method: Method, options: dict[str, str]) -> None:
    """As in plan.json: what is left at its default is not said."""
    assert options_of(method) == options
    assert method_of(method.name, options.items()) == method


def test_methods_of_no_such_name_are_refused() -> None:
    with pytest.raises(RequirementError, match="method: got 'best', expected one of greedy, proven, paper"):
        method_of("best")
