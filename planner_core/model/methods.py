"""The methods of planning, each with its settings: what `PlanSettings.method` holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from planner_core.errors import RequirementError
from planner_core.model.spatial_search import METHODS as SEARCHES
from planner_core.model.spatial_search import SearchSettings

# ------------------------------------------------------------------------------------------------------------- genetic
# The settings of genetic selection: operators, rates and when to stop, with the paper's values as defaults.
# References ---------- López et al. 2023, section 3.6 and Table 3 (its labels are lost in the copy at hand:
# docs/method/genetic-selection.md).

OBJECTIVES = ("fewest", "coverage-at-most-n", "eq9")
SELECTIONS = ("tournament", "elitist")
CROSSOVERS = ("two-point", "one-point", "uniform")
REPLACEMENTS = ("stationary", "generational")

#: Ranking compares every individual with every other one: 16384 take as long as a scan.
MAX_POPULATION = 16_384
#: The host keeps the best figures of every iteration.
MAX_ITERATIONS = 1_000_000


@dataclass(frozen=True)
class GeneticSettings:
    """How the population evolves. Same problem, same settings, same trajectory, on every device and on the host.

    objective : `fewest` stations that meet the targets; `coverage-at-most-n`, most area with at most `n_stations`;
    `eq9`, area per station, the paper's (degenerate: one station wins).
    """

    objective: str = "fewest"
    n_stations: int = 0
    """For `coverage-at-most-n` alone, at least 1."""
    seed: int | None = None
    """0 to 2^64 - 1; None: the plan's; 0 without one."""
    population: int = 500
    n_parents: int = 250
    """Size of the mating pool, and offspring an iteration where replacement is stationary."""
    selection: str = "tournament"
    """`tournament` of `tournament_size`, or `elitist`: the best."""
    tournament_size: int = 2
    crossover: str = "two-point"
    """`one-point`, `two-point` or `uniform`."""
    crossover_rate: float = 0.8
    """Share of pairs that are crossed; the others are copied."""
    individual_mutation_rate: float = 0.1
    """Share of offspring that mutate."""
    gene_mutation_rate: float = 0.02
    """Share of genes that flip in an offspring that mutates."""
    replacement: str = "stationary"
    """`stationary`: the best offspring replace the worst individuals where they are better; `generational`: all
    individuals but the `n_elite` best."""
    n_elite: int = 0
    distinct: bool = False
    """Whether stationary replacement turns away offspring that are in the population already. The paper's does not, and
    its population ends as copies of one set."""
    max_iterations: int = 50_000
    patience: int = 30
    """Iterations without improvement after which the search stops."""
    expected_active: float | None = None
    """Mean number of stations of the random individuals; None: half of the candidates. Each individual has a number
    of its own, as in the paper."""

    def __post_init__(self) -> None:
        self._check_words()
        self._check_rates()
        self._check_counts()

    @property
    def n_offspring(self) -> int:
        """Offspring bred in an iteration."""
        return self.n_parents if self.replacement == "stationary" else self.population - self.n_elite

    def _check_words(self) -> None:
        for name, known in (
            ("objective", OBJECTIVES),
            ("selection", SELECTIONS),
            ("crossover", CROSSOVERS),
            ("replacement", REPLACEMENTS),
        ):
            value = getattr(self, name)
            if value not in known:
                raise RequirementError(f"genetic {name}: got {value!r}, expected one of {', '.join(known)}")

    def _check_rates(self) -> None:
        for name in ("crossover_rate", "individual_mutation_rate", "gene_mutation_rate"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1.0:
                raise RequirementError(f"genetic {_words(name)}: got {value}, expected 0 to 1; e.g. 0.1")
        wanted = self.expected_active
        usable = isinstance(wanted, int | float) and not isinstance(wanted, bool) and math.isfinite(wanted)
        if wanted is not None and not (usable and wanted > 0):
            raise RequirementError(
                f"genetic expected active: got {wanted}, expected a number of stations above 0; e.g. 40"
            )

    def _check_counts(self) -> None:
        least_most = {
            "n_stations": (1 if self.objective == "coverage-at-most-n" else 0, 2**31 - 1),
            "seed": (0, 2**64 - 1),
            "population": (2, MAX_POPULATION),
            "n_parents": (2, self.population),
            "tournament_size": (1, 64),
            "n_elite": (0, self.population - 1),
            "max_iterations": (0, MAX_ITERATIONS),
            "patience": (1, MAX_ITERATIONS),
        }
        for name, (least, most) in least_most.items():
            value = getattr(self, name)
            if name == "seed" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
                raise RequirementError(
                    f"genetic {_words(name)}: got {value}, expected a whole number from {least} to {most}"
                )
        if self.n_elite and self.replacement == "stationary":
            raise RequirementError(
                f"genetic n elite: got {self.n_elite} with stationary replacement, which keeps the best anyway; "
                "expected 0, or generational replacement"
            )
        if self.distinct and self.replacement == "generational":
            raise RequirementError(
                "genetic distinct: got it with generational replacement, which takes all offspring; expected stationary"
            )


def _words(name: str) -> str:
    return name.replace("_", " ")


# ------------------------------------------------------------------------------------------------------------- methods
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
