"""A small plan made by hand: two rooms, two floors, a doorway; what it sees is scanned with Open3D."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from small_pictures import draw_small

from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    Coverage,
    Element,
    Floor,
    Greedy,
    Link,
    LoadReport,
    Plan,
    PlanSettings,
    Requirements,
    Scanner,
    Scene,
    SceneSource,
    Station,
    Storey,
    Survey,
    UnseenElement,
    VisibilityMode,
)
from planner_core.plan_folder import pictures
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.scanner.template import make_template
from planner_core.scene.patches import make_patches

OFFSET_M = np.array([500_000.0, 4_000_000.0, 100.0])

_BOX_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
     [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]]
)  # fmt: skip

# name, kind, storey, low corner, high corner
_BOXES = (
    ("Slab: ground (0)", "IfcSlab", 0, (0, 0, -0.2), (8, 4, 0)),
    ("Slab: upper", "IfcSlab", 1, (0, 0, 2.6), (8, 4, 2.8)),
    ("Roof", "IfcRoof", 1, (0, 0, 5.4), (8, 4, 5.6)),
    ("Wand süd", "IfcWall", 0, (0, -0.2, 0), (8, 0, 5.4)),
    ("Wand nord", "IfcWall", 0, (0, 4, 0), (8, 4.2, 5.4)),
    ("Wall", "IfcWall", 0, (-0.2, 0, 0), (0, 4, 5.4)),
    ("Wall", "IfcWall", 0, (8, 0, 0), (8.2, 4, 5.4)),
    ("Partition south", "IfcWall", 0, (3.9, 0, 0), (4.1, 1.5, 2.6)),
    ("Partition north", "IfcWall", 0, (3.9, 2.5, 0), (4.1, 4, 2.6)),
    ("Lintel", "IfcWall", 0, (3.9, 1.5, 2.1), (4.1, 2.5, 2.6)),
    ("1st cupboard", "IfcFurniture", 1, (5, 3, 2.8), (6, 4, 4.8)),
    ("Nothing's name", "", -1, (20, 20, 0), (21, 21, 1)),
)

SCANNER = Scanner(
    name="test", title="Test scanner", source="made up", range_min_m=0.3, range_max_m=6.0, n_azimuths=180,
    elevation_rad=tuple(np.deg2rad(np.linspace(45, -60, 40))), instrument_height_min_m=1.2, instrument_height_max_m=1.8,
)  # fmt: skip


def make_scene() -> Scene:
    """Boxes as `_BOXES` says, one element each, and one element that has no triangles."""
    vertices, triangles = [], []
    for index, (_, _, _, low, high) in enumerate(_BOXES):
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
        vertices.append(np.asarray(low) + corners * (np.asarray(high) - np.asarray(low)))
        triangles.append(_BOX_FACES + 8 * index)
    elements = [Element(name, kind, f"id-{i}", storey) for i, (name, kind, storey, _, _) in enumerate(_BOXES)]
    return Scene(
        source=SceneSource(Path("folder/two floors.ifc"), "ab" * 32, "ifc", "millimetre", 0.001, "Z", "IFC4"),
        vertices_m=np.concatenate(vertices).astype(np.float64),
        triangles=np.concatenate(triangles).astype(np.int32),
        element_of_triangle=np.repeat(np.arange(len(_BOXES)), 12).astype(np.int32),
        elements=(*elements, Element("Empty", "IfcDoor", "id-none", 0)),
        storeys=(Storey("Erdgeschoss", "s0", 0.0), Storey("Obergeschoß", "s1", 2.8)),
        offset_m=OFFSET_M,
        report=LoadReport(n_faces_read=150, n_degenerate=6, dropped=("Wall, face 3: degenerate",)),
    )


def make_survey(max_patch_area_m2: float = 0.25) -> Survey:
    scene = make_scene()
    floors = (
        Floor("F0", "Erdgeschoss", 0.0, 32.0, np.array([2, 3], dtype=np.int32), np.array([[0.0, 0], [8, 4]]), "slab"),
        Floor("F1", "Obergeschoß", 2.8, 32.0, np.array([14, 15], dtype=np.int32), np.array([[0.0, 0], [8, 4]]), "slab"),
    )
    floor_of_triangle = np.repeat([0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 1, -1], 12).astype(np.int32)
    patches = make_patches(scene, max_area_m2=max_patch_area_m2)
    template = make_template(SCANNER)
    return Survey(scene, floors, patches, floor_of_triangle, template, SCANNER, VisibilityMode.BEAMS, (0, 1))


def make_stations() -> tuple[Station, ...]:
    rows = (("S001", "F0", 1, (2.0, 2.0, 1.5)), ("S002", "F0", 2, (6.0, 2.2, 1.5)), ("S003", "F1", 3, (3.0, 1.5, 4.4)))
    return tuple(Station(i, f, n, np.array(p), 1.5 if f == "F0" else 1.6, covered_area_m2=9.5) for i, f, n, p in rows)


def make_plan(survey: Survey, engine: ScanEngine) -> Plan:
    """What three stations see, counted by hand; achievable: what they see and every other patch inside."""
    stations = make_stations()
    seen = engine.visible_patches(survey.template, np.array([s.position_m for s in stations]))
    times_seen = np.bincount(seen.patch, minlength=survey.patches.n_patches).astype(np.int32)
    achievable = (times_seen > 0) | (np.arange(times_seen.size) % 3 == 0)
    area_m2 = survey.patches.area_m2
    floor = survey.floor_of_triangle[survey.patches.triangle_of_patch]

    def coverage(which: np.ndarray) -> Coverage:
        return Coverage(
            achievable_area_m2=float(area_m2[which & achievable].sum()),
            total_area_m2=float(area_m2[which].sum()),
            covered_area_m2=float(area_m2[which & (times_seen > 0)].sum()),
        )

    return Plan(
        survey=survey,
        settings=PlanSettings(
            scanner=SCANNER, requirements=Requirements(0.9, 0.3), max_patch_area_m2=0.25, method=Greedy()
        ),
        stations=stations,
        times_seen=times_seen,
        achievable=achievable,
        coverage=coverage(np.ones(times_seen.size, dtype=np.bool_)),
        coverage_by_floor=(coverage(floor == 0), coverage(floor == 1)),
        coverage_curve=(0.4, 0.7, 0.92),
        links=(Link("S001", "S002", 0.35, 0.2), Link("S002", "S003", 0.05, float("nan"))),
        connected=False,
        unseen=(UnseenElement(3, "F0", 1.25, 40.0), UnseenElement(11, "", 0.5, 3.0)),
        lower_bound=2,
        n_candidates=120,
        engine=engine.device,
        warnings=("units were guessed",),
        timings_s={"select": 0.5, "candidates": 1.25},
    )


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests of the plan folder on one worker, so that it is written once."""
    for item in items:
        if item.path.parent == Path(__file__).parent and "plan_folder" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("plan folder"))


@pytest.fixture(scope="session", autouse=True)
def _coarse_pictures() -> Iterator[None]:
    """Draw coverage pictures without smooth edges: a software renderer takes seconds for each otherwise."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "OVERSAMPLING", 1)
        patch.setattr(pictures, "CAP_CELLS", 400)
        yield


@pytest.fixture
def thumbnails(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw all pictures small, for tests that want a plan folder and look at none of them."""
    draw_small(monkeypatch)


@pytest.fixture(scope="session")
def survey() -> Survey:
    return make_survey()


@pytest.fixture(scope="session")
def engine(survey: Survey) -> ScanEngine:
    return open_engine(survey.scene, survey.patches, engine="open3d")


@pytest.fixture(scope="session")
def plan(survey: Survey, engine: ScanEngine) -> Plan:
    return make_plan(survey, engine)


@pytest.fixture(scope="session")
def small(plan: Plan) -> Plan:
    """The plan without stations and floors, which is written in no time."""
    nowhere = np.full_like(plan.survey.floor_of_triangle, -1)
    survey = dataclasses.replace(plan.survey, floors=(), planned=(), floor_of_triangle=nowhere)
    return dataclasses.replace(plan, survey=survey, stations=(), links=(), coverage_by_floor=(), coverage_curve=())


@pytest.fixture(scope="session")
def plan_folder(plan: Plan, engine: ScanEngine, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plan written once, with small pictures; tests only read it."""
    folder = tmp_path_factory.mktemp("plans") / "plan"
    with pytest.MonkeyPatch.context() as patch:
        draw_small(patch)
        write_plan_folder(plan, folder, engine=engine)
    return folder


@pytest.fixture
def folder(small: Plan, engine: ScanEngine, tmp_path: Path) -> Path:
    """A folder of `small`, which the test may change."""
    write_plan_folder(small, tmp_path / "plan", engine=engine)
    return tmp_path / "plan"
