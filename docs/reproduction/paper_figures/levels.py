"""One level of a synthetic building made ready to measure on: what most figures of the reproduction begin with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BoolArray,
    Candidates,
    FloatArray,
    Floor,
    PlanSettings,
    Scanner,
    Scene,
    Survey,
    VisibilityMode,
)
from planner_core.plan_folder.section_view import CUT_HEIGHT_M, section_lines
from planner_core.positions.admissibility import Tripods
from planner_core.positions.candidates import N_HALVINGS, find_candidates
from planner_core.scanner.load_scanner import load_scanner

if TYPE_CHECKING:
    from .figure import Bench

#: Table 2's patch size is not given; ours is the planner's own.
PATCH_AREA_M2 = 0.04


@dataclass(frozen=True)
class Level:
    """A level to plan, with an open engine. Local frame, metres."""

    survey: Survey
    settings: PlanSettings
    engine: ScanEngine
    index: int
    native_columns: int
    """Columns of a scan of the scanner as its maker builds it."""

    @property
    def columns(self) -> dict[str, dict[str, int]]:
        """Columns of a scan, by scanner: for `at_native_columns`."""
        scanner = self.settings.scanner
        return {scanner.name: {"used": scanner.n_azimuths, "native": self.native_columns}}

    @property
    def floor(self) -> Floor:
        """The level's ground."""
        return self.survey.floors[self.index]

    @cached_property
    def tripods(self) -> Tripods:
        """Where tripods can stand."""
        return Tripods(self.survey, self.settings, self.engine)

    def candidates(self, *, n_halvings: int = N_HALVINGS) -> Candidates:
        """Admissible positions of the uniform grid, halved where it found nothing; not so with `n_halvings` 0."""
        return find_candidates(self.tripods, n_halvings=n_halvings)

    def walls_m(self) -> FloatArray:
        """(N, 2, 2) what a cut at 1.2 m above the ground meets."""
        return section_lines(self.survey, self.floor.elevation_m + CUT_HEIGHT_M)[:, :, :2]

    def patches_of_level(self) -> BoolArray:
        """(P,) patches whose coverage counts for this level."""
        return np.asarray(self.survey.floor_of_triangle[self.survey.patches.triangle_of_patch] == self.index)


def open_level(
    bench: Bench,
    scene: str | Scene,
    *,
    floor: int = 0,
    scanner: str | Scanner = "hdl-64e",
    n_azimuths: int | None = None,
    grid_step_m: float = 0.5,
    heights_m: tuple[float, ...] = (),
    max_patch_area_m2: float = PATCH_AREA_M2,
) -> Level:
    """Build a synthetic scene by its name, or take one, and get one of its levels ready.

    `n_azimuths` thins the scanner's columns out, for quick looks: verdicts are for native columns. `grid_step_m` is the
    voxel in plan; in height it is 0.4 m, Table 1's. `heights_m`: fixed heights; empty: the scanner's range.
    """
    built = scenes_synthetic.build(scene, seed=bench.seed).scene if isinstance(scene, str) else scene
    used = load_scanner(scanner) if isinstance(scanner, str) else scanner
    settings = PlanSettings(
        scanner=used if n_azimuths is None else replace(used, n_azimuths=n_azimuths),
        seed=bench.seed,
        grid_step_m=grid_step_m,
        instrument_heights_m=heights_m,
        max_patch_area_m2=max_patch_area_m2,
        scan_mode=VisibilityMode.BEAMS,
    )
    survey = replace(make_survey(built, settings), planned=(floor,))
    engine = open_engine(survey.scene, survey.patches)
    bench.warn(engine.warnings)
    return Level(survey, settings, engine, floor, used.n_azimuths)
