"""Rooms built of boxes, with an engine, candidates and what they see."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.coverage.why import explain
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    Element,
    Floor,
    LoadReport,
    PlanSettings,
    PointLimits,
    Requirements,
    Room,
    Scanner,
    Scene,
    SceneSource,
    Survey,
    Visibility,
    VisibilityMode,
    Why,
)
from planner_core.scanner.template import make_template
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import make_patches

BOX_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
     [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]]
)  # fmt: skip
_CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


def box_corners(low, high) -> np.ndarray:
    return np.asarray(low) + _CORNERS * (np.asarray(high, dtype=np.float64) - np.asarray(low))


def shell(low, high, thick=0.2, prefix="") -> list[tuple[str, tuple, tuple]]:
    """Six boxes around the clear space from `low` to `high`, which touch each other."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    t = thick
    return [
        (prefix + "floor", (x0 - t, y0 - t, z0 - t), (x1 + t, y1 + t, z0)),
        (prefix + "ceiling", (x0 - t, y0 - t, z1), (x1 + t, y1 + t, z1 + t)),
        (prefix + "west", (x0 - t, y0 - t, z0), (x0, y1 + t, z1)),
        (prefix + "east", (x1, y0 - t, z0), (x1 + t, y1 + t, z1)),
        (prefix + "south", (x0, y0 - t, z0), (x1, y0, z1)),
        (prefix + "north", (x0, y1, z0), (x1, y1 + t, z1)),
    ]


def room(name, low, high) -> Room:
    return Room(name, "", f"id-{name}", -1, box_corners(low, high).astype(np.float64), BOX_FACES.astype(np.int32))


def scanner(range_max_m=50.0, low_deg=-89.0, high_deg=89.0, rows=120, columns=240) -> Scanner:
    return Scanner(
        name="test", title="Test", source="made up", range_min_m=0.0, range_max_m=range_max_m, n_azimuths=columns,
        elevation_rad=tuple(np.deg2rad(np.linspace(high_deg, low_deg, rows))), instrument_height_min_m=1.0,
        instrument_height_max_m=2.0,
    )  # fmt: skip


@dataclass
class World:
    """A survey of boxes, its engine, and what candidates see."""

    survey: Survey
    settings: PlanSettings
    engine: ScanEngine
    candidates_m: np.ndarray
    seen: Visibility

    def explain(self, stations=(0,), **options) -> Why:
        rows = [self.seen.row(i) for i in stations]
        starts = np.concatenate([[0], np.cumsum([row.size for row in rows])]).astype(np.int64)
        patch = np.concatenate([np.zeros(0, np.int32), *rows])
        scope = options.pop("scope", np.ones(self.seen.n_patches, dtype=bool))
        return explain(
            self.survey, self.settings.requirements, self.engine, candidates_m=self.candidates_m,
            seen_by_candidates=self.seen,
            station_ids=[f"S{i}" for i in stations], seen_by_stations=Visibility(starts, patch, self.seen.n_patches),
            scope=scope, **options,
        )  # fmt: skip

    def reasons(self, name: str, why: Why) -> np.ndarray:
        """(P',) reasons of the patches of one element."""
        return why.reason_of_patch[self.of(name)]

    def of(self, name: str) -> np.ndarray:
        """(P,) bool: patches of one element."""
        index = [e.name for e in self.survey.scene.elements].index(name)
        return (self.survey.scene.element_of_triangle == index)[self.survey.patches.triangle_of_patch]


def world(boxes, candidates_m, *, rooms=(), scan=None, limits=None, seen_from=1, optics=None, patch_m2=0.1) -> World:
    names = [name for name, _, _ in boxes]
    scene = scene_from_arrays(
        np.concatenate([box_corners(low, high) for _, low, high in boxes]),
        np.concatenate([BOX_FACES + 8 * i for i in range(len(boxes))]),
        element_of_triangle=np.repeat(np.arange(len(boxes)), 12),
        elements=[Element(name, "IfcWall", f"id-{name}") for name in names],
        optics_of_triangle=None if optics is None else np.repeat([optics.get(name, 0) for name in names], 12),
    )
    scene = replace(scene, rooms=tuple(rooms))
    scan = scan or scanner()
    patches = make_patches(scene, max_area_m2=patch_m2)
    floor = Floor("F0", "Ground", 0.0, 10.0, np.array([2, 3], np.int32), np.array([[0.0, 0], [4, 3]]), "slab")
    on_floor, template = np.zeros(scene.n_triangles, np.int32), make_template(scan)
    survey = Survey(scene, (floor,), patches, on_floor, template, scan, VisibilityMode.BEAMS, (0,))
    required = Requirements(limits=limits or PointLimits(), seen_from=seen_from)
    settings = PlanSettings(scanner=scan, requirements=required)
    engine = open_engine(scene, patches, engine="open3d")
    at = np.asarray(candidates_m, dtype=np.float64)
    return World(survey, settings, engine, at, engine.visible_patches(survey.template, at))


def scene_of(vertices_m, triangles) -> Scene:
    return Scene(
        SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        np.ascontiguousarray(vertices_m, dtype=np.float64), np.ascontiguousarray(triangles, dtype=np.int32),
        np.zeros(len(triangles), np.int32), (Element("soup", "Mesh", "0"),), (), np.zeros(3), LoadReport(0),
    )  # fmt: skip


@pytest.fixture(scope="session")
def build() -> SimpleNamespace:
    """The makers above."""
    return SimpleNamespace(
        world=world, shell=shell, room=room, scanner=scanner, scene_of=scene_of, box=box_corners, faces=BOX_FACES
    )
