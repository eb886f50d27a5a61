"""What decides a spatial search besides its starts and the landscape: the settings of the paper's Table 1.

References
----------
López et al. 2023, sections 3.5.1 to 3.5.4 and Table 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner_core.errors import RequirementError

#: What `search` accepts: greedy local search, simulated annealing, tabu search.
METHODS = ("ls", "sa", "ts")
#: `cube`: faces and corners of a cube (8 vectors of a square at fixed height); `sphere`: even directions (a circle).
NEIGHBOURHOODS = ("cube", "sphere")

#: Every direction is compared with every other one; so many are 4 degrees apart.
MOST_DIRECTIONS = 2048


@dataclass(frozen=True)
class SearchSettings:
    """Same starts, landscape and settings: same result, byte for byte. Defaults are the paper's where it gives one."""

    seed: int | None = None
    """None: the plan's; 0 without one."""
    max_iterations: int = 60
    max_without_improvement: int = 10
    """Iterations after which tabu search gives a place up that has brought no new best of its agent."""
    neighbourhood: str = "sphere"
    n_directions: int = 16
    """Of the sphere or circle; even, so that every direction has its opposite. The cube has 14, the square 8."""
    step_m: float = 0.05
    fixed_height: bool | None = None
    """Whether agents stay at the height of their start; None: where the plan tries one height alone."""
    reversal_slack: float = 1e-6
    """The paper's epsilon: a move is the last one undone where their unit vectors' dot product is below this - 1."""
    initial_temperature: float = 450.0
    """In units of F2."""
    cooling: float = 0.8
    """Factor from one iteration's temperature to the next one's."""
    least_temperature: float = 1e-3
    """Annealing stops below. The paper gives none; this one is passed after 59 iterations of its cooling."""
    tabu_voxel_steps: float = 1.5
    """Length of a tabu voxel in steps, between 1 and 2: the paper's f, which it leaves open."""
    memoised: bool = True
    """Whether positions lie on a lattice and the landscape is evaluated once a cell (the paper's optimised version)."""
    memo_cell_steps: float = 1.0
    """Length of a lattice cell in steps, at most 1: every move leaves its cell."""
    lattice_origin_m: tuple[float, float, float] | None = None
    """Centre of one lattice cell, and a corner of one tabu voxel; local frame. None: the middle of the bounds in plan,
    at their least height, on whose lattice the usual grids of starts lie."""

    def __post_init__(self) -> None:
        """Refuse settings that make no sense, naming the first one.

        Raises
        ------
        RequirementError
        """
        _check_neighbourhood(self)
        for name, least in (("seed", 0), ("max_iterations", 1), ("max_without_improvement", 1)):
            if (value := getattr(self, name)) is not None and value < least:
                raise RequirementError(f"{name}: got {value}, expected at least {least}; leave it out")
        for name, low, high in (
            ("step_m", 0.0, math.inf),
            ("reversal_slack", 0.0, 1.0),
            ("initial_temperature", 0.0, math.inf),
            ("least_temperature", 0.0, math.inf),
            ("cooling", 0.0, 1.0),
            ("tabu_voxel_steps", 1.0, 2.0),
        ):
            if not low < getattr(self, name) < high:
                raise RequirementError(
                    f"{name}: got {getattr(self, name):g}, expected more than {low:g} and less than {high:g}; "
                    "leave it out for the default"
                )
        if not self.least_temperature <= self.initial_temperature:
            raise RequirementError(
                f"least_temperature: got {self.least_temperature:g}, expected at most initial_temperature, "
                f"{self.initial_temperature:g}; lower it"
            )
        if not 0 < self.memo_cell_steps <= 1:
            raise RequirementError(
                f"memo_cell_steps: got {self.memo_cell_steps:g}, expected more than 0 and at most 1; e.g. 1"
            )
        origin = self.lattice_origin_m
        if origin is not None and (len(origin) != 3 or not all(math.isfinite(x) for x in origin)):
            raise RequirementError(f"lattice_origin_m: got {origin}, expected three finite metres; leave it out")

    @property
    def cell_m(self) -> float:
        """Unit of lattice coordinates."""
        return self.step_m * (self.memo_cell_steps if self.memoised else 1.0)

    @property
    def cells_a_step(self) -> float:
        """Length of a step in lattice coordinates; exactly 1 where a cell is a step."""
        return 1.0 / self.memo_cell_steps if self.memoised else 1.0


def _check_neighbourhood(settings: SearchSettings) -> None:
    if settings.neighbourhood not in NEIGHBOURHOODS:
        raise RequirementError(
            f"neighbourhood: got {settings.neighbourhood!r}, expected one of {', '.join(NEIGHBOURHOODS)}; "
            "leave it out for the default"
        )
    if not 4 <= settings.n_directions <= MOST_DIRECTIONS or settings.n_directions % 2:
        raise RequirementError(
            f"n_directions: got {settings.n_directions}, expected an even number from 4 to {MOST_DIRECTIONS}; e.g. 16"
        )
