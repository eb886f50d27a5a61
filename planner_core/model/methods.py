"""The methods of planning, each with its settings: what `PlanSettings.method` holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from planner_core.errors import RequirementError
from planner_core.model.genetic import GeneticSettings
from planner_core.model.spatial_search import METHODS as SEARCHES
from planner_core.model.spatial_search import SearchSettings

STARTS = ("uniform", "random")
POOLS = ("both", "improved")
COUNTS = ("area", "patches")
DISTANCES = ("squared", "euclidean")


@dataclass(frozen=True)
class Greedy:
    """One station after the other, each the one that adds most, in seconds; connected or not."""

    name: ClassVar[str] = "greedy"


@dataclass(frozen=True)
class Proven:
    """Few stations as one network, with a bound on how few there can be, see `planner_core.select.proven`.

    work_limit : numbers read, in 1e9, roughly seconds of one core. time_limit_s : besides, of the clock; with it
    two runs may differ. n_walks : annealings side by side, each with its own random numbers; results depend on it, and
    not on the number of cores. prove : whether to work on the bound, too; if not, all of the work goes into fewer
    stations.
    """

    name: ClassVar[str] = "proven"
    work_limit: float = 150.0
    time_limit_s: float | None = None
    seed: int | None = None
    """None: the plan's; 0 without one."""
    n_walks: int = 4
    prove: bool = True

    def __post_init__(self) -> None:
        if not self.work_limit >= 0:
            raise RequirementError(f"work limit: got {self.work_limit}, expected 0 or more; e.g. 60")
        if self.time_limit_s is not None and not self.time_limit_s >= 0:
            raise RequirementError(f"time limit: got {self.time_limit_s} s, expected 0 or more, or none; e.g. 60")
        if self.seed is not None and not 0 <= self.seed < 2**64:
            raise RequirementError(f"seed: got {self.seed}, expected a whole number from 0 to 2^64 - 1")
        if not 1 <= self.n_walks <= 1024:
            raise RequirementError(f"walks: got {self.n_walks}, expected a whole number from 1 to 1024; e.g. 4")


@dataclass(frozen=True)
class F2Settings:
    """How F2 is measured."""

    distance: str = "squared"
    """`squared`: d^2, as Eq. 2 and 6 are printed; `euclidean`: d, as the paper's text has it, some times slower."""

    def __post_init__(self) -> None:
        if self.distance not in DISTANCES:
            raise RequirementError(f"f2.distance: got {self.distance!r}, expected one of {', '.join(DISTANCES)}")


@dataclass(frozen=True)
class Paper:
    """The method paper's pipeline, see `planner_core.paper.pipeline`."""

    name: ClassVar[str] = "paper"
    search: str = "sa"
    """`ls` greedy local search, `sa` simulated annealing, `ts` tabu search, `none`: starts stay where they are."""
    starts: str = "uniform"
    """`uniform`: the grid of the plan's settings; `random`: `n_random` per floor."""
    n_random: int = 200
    pool: str = "both"
    """What is selected from: `both` starts and improved positions, or `improved` ones alone, as in the paper. Searches
    leave small rooms, and then no selection of improved positions covers what is required."""
    halve_grid: bool = True
    """Whether uniform starts lie closer where the grid finds nothing, as in small rooms; the paper's grid does not."""
    thin_cell_m: float = 0.0
    """Length in plan of the cells of which one position each is kept, that of least F2, as in Fig. 12; 0: all are."""
    best_k: int = 0
    """How many positions of each floor are kept, the best by F2, as in Fig. 11 and 17; 0: all are."""
    best_apart_m: float = 0.0
    """Least distance of those `best_k`."""
    count: str = "area"
    """What Eq. 9 counts: `area` reached, or `patches`, as printed. Only with genetic.objective eq9."""
    published_tests: bool = False
    """Whether the paper's three tests decide where a tripod can stand, instead of ours."""
    repair: bool = True
    """Whether stations are added until all overlap as required and link up."""
    overlap_radius_m: float = 0.0
    """Radius of the circles that stand for scans; 0: the scanner's greatest range."""
    f2: F2Settings = field(default_factory=F2Settings)
    spatial: SearchSettings = field(default_factory=SearchSettings)
    genetic: GeneticSettings = field(default_factory=GeneticSettings)

    def __post_init__(self) -> None:
        """Refuse words that mean nothing, and a number of starts below 1."""
        known_words = (("search", (*SEARCHES, "none")), ("starts", STARTS), ("pool", POOLS), ("count", COUNTS))
        for name, known in known_words:
            if getattr(self, name) not in known:
                raise RequirementError(f"{name}: got {getattr(self, name)!r}, expected one of {', '.join(known)}")
        if self.n_random < 1:
            raise RequirementError(f"n_random: got {self.n_random}, expected at least 1; leave it out for 200")
        if self.best_k < 0:
            raise RequirementError(f"best_k: got {self.best_k}, expected 0 or more; 0 keeps all positions")
        for name, example in (("overlap_radius_m", 5), ("thin_cell_m", 1.5), ("best_apart_m", 1)):
            if not 0 <= getattr(self, name) < math.inf:
                raise RequirementError(f"{name}: got {getattr(self, name):g}, expected 0 or more; e.g. {example}")
        if self.count == "patches" and self.genetic.objective != "eq9":
            raise RequirementError(
                f"count: got patches with genetic.objective {self.genetic.objective}, whose coverage is of area; "
                "expected genetic.objective=eq9"
            )


Method: TypeAlias = Greedy | Proven | Paper
METHODS: dict[str, type[Method]] = {each.name: each for each in (Greedy, Proven, Paper)}
"""By the names that the command line and plan.json have for them."""
