"""Hole walls and hard scenes: what makes each of them hard is there, and all of them plan."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import PatchMode
from planner_core.errors import RequirementError, SceneError
from planner_core.model import BeamTemplate, Greedy, PlanSettings, Requirements, Scene
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.patches import make_patches
from scenes_synthetic import hole_walls
from scenes_synthetic.model import SyntheticScene

pytestmark = pytest.mark.slow

COARSE = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=180),
    requirements=Requirements(coverage=0.6),
    grid_step_m=2.0,
    instrument_heights_m=(1.3,),
    max_patch_area_m2=1.0,
    method=Greedy(),
)


# ---------------------------------------------------------------------------------------------------- hole walls
@pytest.fixture(scope="module")
def hole_scene() -> SyntheticScene:
    return scenes_synthetic.build("hole-walls")


@pytest.mark.parametrize("engine_name", ["opencl", "open3d"])
def test_scan_from_the_court_sees_the_areas_of_similar_triangles(hole_scene: SyntheticScene, engine_name: str) -> None:
    scene = hole_scene.scene
    patches = make_patches(scene, max_area_m2=0.02)
    mode = PatchMode(open_engine(scene, patches, engine=engine_name), scene, patches)
    template = BeamTemplate(
        azimuth_rad=np.arange(60_000) * (2 * np.pi / 60_000),
        elevation_rad=np.linspace(np.pi / 2, -np.pi / 2, 30_001),
        range_min_m=0.0,
        range_max_m=100.0,
    )
    element = scene.element_of_triangle[patches.triangle_of_patch]
    for view in hole_scene.truth.views:
        seen = mode.see(template, np.array([view.station_m]))
        area_m2 = patches.area_m2[seen.patch]
        found = np.bincount(element[seen.patch], seen.share * area_m2, len(scene.elements))
        across = np.bincount(element[seen.patch], area_m2 * (seen.share < 1), len(scene.elements))
        for part, area, slack in zip(hole_scene.parts, found, 0.12 * across + 0.02, strict=True):
            exact_m2 = view.visible_area_m2.get(part.name, 0.0)
            assert abs(area - exact_m2) < slack, f"{part.name} at {view.station_m}: {area}, {exact_m2}"


def test_the_ring_between_the_walls_is_a_room_with_the_areas_of_its_plan(hole_scene: SyntheticScene) -> None:
    truth = hole_scene.truth
    hole = 0.6 * 0.15
    assert truth.floor_area_m2 == pytest.approx({"Court": 2**2, "Ring": 8**2 - 3.2**2}, rel=1e-12)
    walls = {"Court": 4 * (2 * 2.7 - hole), "Ring": 4 * 8 * 2.7 + 4 * (3.2 * 2.7 - hole)}
    assert truth.wall_area_m2 == pytest.approx(walls, rel=1e-12)


def test_as_much_of_the_hall_is_free_as_the_floors_of_court_and_ring_say(hole_scene: SyntheticScene) -> None:
    import open3d as o3d

    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(hole_scene.scene.vertices_m.astype(np.float32), hole_scene.scene.triangles.astype(np.uint32))
    step = 0.05
    x, y = np.meshgrid(*[np.arange(-4.0 + step / 2, 4.0, step)] * 2)
    # Below all holes; a spot inside a wall has an odd number of surfaces on its way out.
    rays = np.array(np.broadcast_arrays(x.ravel(), y.ravel(), 0.3, 1.0, 0.0, 0.0), dtype=np.float32).T
    free = caster.count_intersections(o3d.core.Tensor(np.ascontiguousarray(rays))).numpy() % 2 == 0
    in_court = np.abs(rays[:, :2]).max(axis=1) < 1.0
    found = {"Court": np.count_nonzero(free & in_court), "Ring": np.count_nonzero(free & ~in_court)}
    assert {room: n * step**2 for room, n in found.items()} == pytest.approx(hole_scene.truth.floor_area_m2)


def test_the_space_of_the_ring_leaves_out_what_stands_in_it(hole_scene: SyntheticScene, tmp_path: Path) -> None:
    import ifcopenshell
    import ifcopenshell.geom
    import ifcopenshell.util.shape

    model = ifcopenshell.open(str(scenes_synthetic.write(hole_scene, tmp_path / "holes.ifc")))
    shapes = {
        s.Name: ifcopenshell.geom.create_shape(ifcopenshell.geom.settings(), s) for s in model.by_type("IfcSpace")
    }
    volumes = {name: ifcopenshell.util.shape.get_volume(shape.geometry) for name, shape in shapes.items()}
    floors = hole_scene.truth.floor_area_m2
    assert volumes == pytest.approx({name: area * 2.7 for name, area in floors.items()}, rel=1e-9)


def test_each_hole_shows_its_outer_wall_at_its_own_height_only(hole_scene: SyntheticScene) -> None:
    through = {
        view.station_m[2]: {part.split()[-1] for part in view.visible_area_m2 if part.startswith("Outer")}
        for view in hole_scene.truth.views
    }
    for side, height in hole_walls.HOLES_M.items():
        assert through[height] == {side}
    assert sorted(hole_walls.HOLES_M.values()) == [0.6, 1.1, 1.6, 2.1]


@pytest.mark.parametrize(("off_m", "sees"), [(0.32, True), (0.33, False)])
def test_a_hole_closes_0_325_m_above_and_below_its_height(hole_scene: SyntheticScene, off_m: float, sees: bool) -> None:
    engine = open_engine(hole_scene.scene, make_patches(hole_scene.scene, max_area_m2=10.0), engine="open3d")
    slopes = np.linspace(0.0, 0.5, 20_001)
    for sign, height in ((-1.0, 0.6), (1.0, 2.1)):  # past the lowest hole and past the highest
        way = {-1.0: (0.0, -1.0), 1.0: (-1.0, 0.0)}[sign]
        rays = np.column_stack([np.broadcast_to(way, (slopes.size, 2)), -sign * slopes])
        station = np.broadcast_to([0.0, 0.0, height + sign * off_m], rays.shape)
        hits = engine.cast_rays(station, rays, range_max_m=20.0)
        assert bool((hits.range_m > 3.5).any()) is sees


# -------------------------------------------------------------------------------------------------------- buildings
def first_hits(synthetic: SyntheticScene, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Ranges and names of the parts that free rays meet first; NaN and an empty name where there is none."""
    engine = open_engine(synthetic.scene, make_patches(synthetic.scene, max_area_m2=100.0), engine="open3d")
    hits = engine.cast_rays(origins, directions, range_max_m=1000.0)
    element = synthetic.scene.element_of_triangle[hits.triangle]
    names = [synthetic.parts[e].name if t >= 0 else "" for e, t in zip(element, hits.triangle, strict=True)]
    return hits.range_m, names


def test_glass_and_mirror_are_marked_in_every_format_that_can(tmp_path: Path) -> None:
    import ifcopenshell
    import ifcopenshell.util.element
    from pxr import Usd

    synthetic = scenes_synthetic.build("glass-and-mirror")
    wanted = {part.name: part.material for part in synthetic.parts if part.material}
    assert wanted == {"Glass wall": "glass", "Mirror": "mirror"}
    assert set(synthetic.truth.returns_nothing) == set(wanted)

    model = ifcopenshell.open(str(scenes_synthetic.write(synthetic, tmp_path / "a.ifc")))
    found = {e.Name: ifcopenshell.util.element.get_material(e) for e in model.by_type("IfcElement")}
    assert {name: m.Name for name, m in found.items() if m} == wanted
    assert {m.Name: m.Category for m in model.by_type("IfcMaterial")} == {"glass": "glass", "mirror": "mirror"}

    data = scenes_synthetic.write(synthetic, tmp_path / "a.glb").read_bytes()
    tree = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    of_mesh = [tree["meshes"][n["mesh"]]["primitives"][0].get("material") for n in tree["nodes"]]
    named = {n["name"]: tree["materials"][m] for n, m in zip(tree["nodes"], of_mesh, strict=True) if m is not None}
    assert {name: material["name"] for name, material in named.items()} == wanted
    assert {n["name"]: n["extras"]["material"] for n in tree["nodes"] if "material" in n["extras"]} == wanted
    assert named["Glass wall"]["extensions"] == {"KHR_materials_transmission": {"transmissionFactor": 1.0}}
    assert tree["extensionsUsed"] == ["KHR_materials_transmission"]

    stage = Usd.Stage.Open(str(scenes_synthetic.write(synthetic, tmp_path / "a.usda")))
    told = {p.GetAttribute("tlsplan:name").Get(): p.GetAttribute("tlsplan:material").Get() for p in stage.Traverse()}
    assert {name: material for name, material in told.items() if material} == wanted


def test_thin_walls_hide_what_is_behind_them_and_need_two_stations() -> None:
    thin = scenes_synthetic.build("thin-walls")
    thickness = {
        p.name: round(float(np.ptp(p.solid.bounds_m[:, 0])), 6) for p in thin.parts if p.name in ("Board", "Sheet")
    }
    assert thickness == {"Board": 0.01, "Sheet": 0.001}
    rng = np.random.default_rng(1)
    ends = rng.uniform((0.0, 0.0, 0.0), (9.011, 4.0, 2.7), size=(2000, 3))
    origins = np.repeat(thin.truth.stations_m, len(ends), axis=0)
    way = np.tile(ends, (2, 1)) - origins
    ranges, names = first_hits(thin, origins, way)
    # Straight lines through both leaves of a partition, away from the doorway, all end on its near side.
    for name, low, high in (("Board", 3.0, 3.01), ("Sheet", 6.01, 6.011)):
        at = [k for k, n in enumerate(names) if n == name]
        x = origins[at, 0] + ranges[at] * way[at, 0] / np.linalg.norm(way[at], axis=1)
        near = np.where(origins[at, 0] < low, low, high)
        on_face = np.minimum(np.abs(x - low), np.abs(x - high)) < 1e-5
        assert len(at) > 300
        np.testing.assert_allclose(x[on_face], near[on_face], atol=1e-4)
    faces = {(n, bool(origins[k, 0] < 3.0), bool(origins[k, 0] > 6.1)) for k, n in enumerate(names)}
    assert {("Board", True, False), ("Board", False, True), ("Sheet", True, False), ("Sheet", False, True)} <= faces
    assert thin.truth.n_stations == len(thin.truth.stations_m) == 2


def test_open_doors_let_the_corridor_see_the_rooms_and_shut_ones_do_not() -> None:
    azimuth = np.linspace(0.3, np.pi - 0.3, 721)
    rays = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.full(azimuth.size, -0.05)])
    origins = np.tile([4.6, 0.8, 1.5], (len(rays), 1))
    seen = {name: first_hits(scenes_synthetic.build(name), origins, rays) for name in ("doors-open", "doors-shut")}
    deep = {name: np.mean(ranges * rays[:, 1] > 1.2) for name, (ranges, _) in seen.items()}
    assert deep["doors-open"] > 0.2
    assert deep["doors-shut"] < 0.01
    assert "Door 2" in seen["doors-shut"][1]
    open_, shut = (scenes_synthetic.build(name) for name in ("doors-open", "doors-shut"))
    assert open_.truth.wall_area_m2 == shut.truth.wall_area_m2


def test_flights_of_the_stairwell_have_headroom_and_meet_their_slabs() -> None:
    well = scenes_synthetic.build("stairwell")
    for storey in (0, 1):
        treads = np.array([[1.8, 1.2 + (i + 0.5) * 0.26, storey * 2.8 + 2.8 * (i + 1) / 15 + 0.001] for i in range(14)])
        up, _ = first_hits(well, treads, np.tile([0.0, 0.0, 1.0], (14, 1)))
        assert np.nanmin(up) > 2.0
        down, names = first_hits(well, treads, np.tile([0.0, 0.0, -1.0], (14, 1)))
        np.testing.assert_allclose(down, 0.001, atol=1e-5)
        assert set(names) == {f"Flight {storey}"}


def test_levels_see_one_another_through_the_voids() -> None:
    hall, atrium = scenes_synthetic.build("double-height-hall"), scenes_synthetic.build("atrium")
    floor = np.array([[5.0, 3.0, 1.5]])
    assert first_hits(hall, floor, np.array([[0.0, 0.0, 1.0]]))[1] == ["Roof"]
    assert first_hits(hall, np.array([[5.0, 10.0, 4.3]]), np.array([[0.0, -8.0, -4.3]]))[1] == ["Ground slab"]
    middle = np.array([[8.0, 8.0, 1.5]])
    assert first_hits(atrium, middle, np.array([[0.0, 0.0, 1.0]]))[1] == ["Roof"]
    # From the ground floor, across the void, to the far wall of each storey.
    for storey, z in enumerate((1.5, 4.2, 7.0)):
        _, names = first_hits(atrium, np.array([[4.0, 8.0, 1.5]]), np.array([[12.0, 0.3, z - 1.5]]))
        assert names[0] in (f"Wall east {storey}", f"Slab {storey}"), storey
    assert atrium.truth.floor_area_m2 == {"Storey 0": 256.0, "Storey 1": 220.0, "Storey 2": 220.0}


def test_all_surfaces_inside_the_tunnel_but_its_portals_run_along_it() -> None:
    tunnel = scenes_synthetic.build("tunnel")
    assert tunnel.truth.slides_along == (1.0, 0.0, 0.0)
    rng = np.random.default_rng(2)
    rays = rng.normal(size=(4000, 3))
    origins = np.tile([40.0, 0.4, 1.5], (len(rays), 1))
    scene = tunnel.scene
    hits = open_engine(scene, make_patches(scene, max_area_m2=100.0), engine="open3d").cast_rays(
        origins, rays, range_max_m=35.0
    )
    hit = hits.triangle[hits.triangle >= 0]
    a, b, c = (scene.vertices_m[scene.triangles[hit][:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    assert len(hit) > 3500
    assert np.abs(normal[:, 0]).max() == 0.0
    # And the vault is as large as the half polygon of its section says.
    inner = sum(p.solid.area_m2 for p in tunnel.parts if p.name == "Vault")  # outer, inner, both ends and both feet
    n, r, t, length = 16, 3.0, 0.4, 80.0
    shell = 2 * n * np.sin(np.pi / n / 2) * (r + r + t) * length
    ends = n * np.sin(np.pi / n) * ((r + t) ** 2 - r**2)
    assert inner == pytest.approx(shell + ends + 2 * t * length, rel=1e-5)
    portals = n * np.sin(np.pi / n) * r**2
    assert tunnel.truth.wall_area_m2["Tunnel"] == pytest.approx(shell * r / (2 * r + t) + portals, rel=1e-9)


def test_the_facade_stands_on_open_ground_with_its_doors_and_windows_shut() -> None:
    facade = scenes_synthetic.build("facade")
    x, y = np.meshgrid(np.linspace(-5.0, 17.0, 12), np.linspace(-11.0, -1.0, 6))
    outdoors = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1.0)])
    ranges, _ = first_hits(facade, outdoors, np.tile([0.0, 0.0, 1.0], (x.size, 1)))
    assert np.isnan(ranges).all()
    x, z = np.meshgrid(np.linspace(0.4, 11.6, 113), np.linspace(0.1, 5.9, 59))
    front = np.column_stack([x.ravel(), np.full(x.size, -3.0), z.ravel()])
    ranges, names = first_hits(facade, front, np.tile([0.0, 1.0, 0.0], (x.size, 1)))
    kinds = {p.name: p.kind for p in facade.parts}
    share = np.mean([kinds[name] == "IfcWindow" for name in names])
    assert share == pytest.approx(8 * 1.3 * 1.5 / (11.2 * 5.8), rel=0.1)
    # Nothing passes but the gap round the door leaf, a centimetre wide.
    assert np.nanmax(ranges[[kinds[n] != "IfcDoor" for n in names]]) < 7.0
    assert np.mean(ranges > 3.3) < 0.005


# ---------------------------------------------------------------------------------------------------------- copies
def corners(scene: Scene) -> np.ndarray:
    """All triangles in the scene's frame, in an order that does not depend on the file's."""
    points = np.round(scene.vertices_m[scene.triangles] + scene.offset_m, 3)
    order = np.lexsort(np.moveaxis(points, -1, 0)[::-1], axis=1)
    rows = np.take_along_axis(points, order[:, :, None], axis=1).reshape(-1, 9)
    return rows[np.lexsort(rows.T[::-1])]


@pytest.mark.parametrize("suffix", [".ifc", ".obj", ".ply", ".glb", ".usda"])
def test_georeferenced_copy_loads_where_it_is(suffix: str, tmp_path: Path) -> None:
    far = scenes_synthetic.build("georeferenced")
    scene = load_scene(scenes_synthetic.write(far, tmp_path / f"far{suffix}"))
    assert np.abs(scene.vertices_m).max() < 100.0
    low = (scene.vertices_m + scene.offset_m).min(axis=0)
    np.testing.assert_allclose(low, far.truth.extents_m[0] + [500_000.0, 5_400_000.0, 0.0], atol=1e-5)
    area = lambda s: np.linalg.norm(  # noqa: E731
        np.cross(*(s.vertices_m[s.triangles[:, i]] - s.vertices_m[s.triangles[:, 0]] for i in (1, 2))), axis=1
    ).sum()
    assert area(scene) == pytest.approx(area(far.scene), rel=1e-6)
    if suffix != ".ifc":  # whose walls are cut otherwise
        np.testing.assert_allclose(corners(scene), corners(far.scene), atol=2e-3)


def test_georeferenced_copy_is_not_written_where_it_would_be_destroyed(tmp_path: Path) -> None:
    with pytest.raises(
        RequirementError, match="5400000 m, where STL's 32-bit numbers are half a metre apart; write it as"
    ):
        scenes_synthetic.write(scenes_synthetic.build("georeferenced"), tmp_path / "far.stl")


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".usda"])
def test_copy_in_millimetres_y_up_loads_as_the_original(suffix: str, tmp_path: Path) -> None:
    copy, original = scenes_synthetic.build("millimetres-y-up"), scenes_synthetic.build("corridor-comb")
    path = scenes_synthetic.write(copy, tmp_path / f"mm{suffix}")
    if suffix == ".usda":
        scene = load_scene(path)  # the stage says both
    else:
        assert any("--units mm" in warning for warning in load_scene(path).report.warnings)
        scene = load_scene(path, options=LoadOptions(metres_per_unit=0.001, up_axis="Y"))
    assert scene.report.warnings == ()
    np.testing.assert_allclose(corners(scene), corners(original.scene), atol=2e-3)


DAMAGE_CARRIED = {
    ".obj": ("n_non_finite", "n_bad_index"),
    ".ply": ("n_non_finite", "n_bad_index"),
    ".stl": ("n_non_finite",),
    ".glb": ("n_bad_index",),
    ".usda": ("n_bad_index",),
}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("suffix", DAMAGE_CARRIED)
def test_broken_faces_are_found_and_counted_by_kind(suffix: str, seed: int, tmp_path: Path) -> None:
    broken, original = (scenes_synthetic.build(name, seed=seed) for name in ("broken-faces", "corridor-comb"))
    path = scenes_synthetic.write(broken, tmp_path / f"broken{suffix}")
    scene = load_scene(path, options=LoadOptions(skip_bad_faces=True))
    report = scene.report
    kinds = ("n_duplicate", "n_degenerate", *DAMAGE_CARRIED[suffix])
    wanted = {kind: getattr(broken.truth, kind) for kind in kinds}
    assert min(wanted.values()) >= 2
    assert {kind: getattr(report, kind) for kind in kinds} == wanted
    assert report.n_faces_read - scene.n_triangles == sum(wanted.values())
    assert report.n_faces_read == original.scene.n_triangles + sum(wanted.values())
    np.testing.assert_allclose(corners(scene), corners(original.scene), atol=2e-3)


def test_a_twentieth_of_the_faces_in_a_file_is_broken(tmp_path: Path) -> None:
    broken, original = (scenes_synthetic.build(name) for name in ("broken-faces", "corridor-comb"))
    text = scenes_synthetic.write(broken, tmp_path / "broken.obj").read_text()
    n_faces = text.count("\nf ")
    assert (n_faces - original.scene.n_triangles) / n_faces == pytest.approx(0.05, abs=0.003)
    assert "nan" in text
    assert max(int(number) for line in text.splitlines() if line.startswith("f ") for number in line.split()[1:]) > 1e6


@pytest.mark.parametrize("suffix", [suffix for suffix in DAMAGE_CARRIED if "n_bad_index" in DAMAGE_CARRIED[suffix]])
def test_missing_vertices_are_refused_unless_they_may_be_skipped(suffix: str, tmp_path: Path) -> None:
    broken = scenes_synthetic.build("broken-faces")
    n_bad = broken.truth.n_bad_index
    with pytest.raises(SceneError, match=rf"{n_bad} of \d+ faces name vertex 1 000 .* pass --skip-bad-faces"):
        load_scene(scenes_synthetic.write(broken, tmp_path / f"broken{suffix}"))


def test_scene_in_memory_has_no_damage_and_ifc_files_have_none(tmp_path: Path) -> None:
    broken = scenes_synthetic.build("broken-faces")
    assert np.isfinite(broken.scene.vertices_m).all()
    assert broken.scene.triangles.max() < len(broken.scene.vertices_m)
    report = load_scene(scenes_synthetic.write(broken, tmp_path / "broken.ifc")).report
    assert (report.n_non_finite, report.n_bad_index, report.warnings) == (0, 0, ())


def test_copy_without_slabs_is_the_walls_alone() -> None:
    bare, original = scenes_synthetic.build("without-slabs"), scenes_synthetic.build("corridor-comb")
    assert {part.kind for part in bare.parts} == {"IfcWall"}
    assert len(original.parts) - len(bare.parts) == 2
    assert bare.truth.floor_area_m2 == original.truth.floor_area_m2


MORE = (
    *("hole-walls", "glass-and-mirror", "thin-walls", "doors-open", "doors-shut", "double-height-hall"),
    *("georeferenced", "atrium", "tunnel", "facade"),
)
HARD = (
    *("stairwell", "millimetres-y-up", "broken-faces", "without-slabs"),
    *(pytest.param(name, marks=pytest.mark.campaign) for name in MORE),
)
OPTIONS = {
    "millimetres-y-up": LoadOptions(metres_per_unit=0.001, up_axis="Y"),
    "broken-faces": LoadOptions(skip_bad_faces=True),
}


@pytest.mark.parametrize("name", HARD)
def test_hard_scene_loads_and_plans(name: str, tmp_path: Path) -> None:
    path = scenes_synthetic.write(scenes_synthetic.build(name), tmp_path / f"{name}.obj")
    plan = make_plan(load_scene(path, options=OPTIONS.get(name, LoadOptions())), COARSE)
    assert plan.coverage.fraction_of_achievable >= 0.6
    assert 1 <= plan.lower_bound <= len(plan.stations)
