"""The settings of genetic selection: operators, rates and when to stop, with the paper's values as defaults.

References
----------
López et al. 2023, section 3.6 and Table 3 (its labels are lost in the copy at hand: docs/method/genetic-selection.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner_core.errors import RequirementError

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
