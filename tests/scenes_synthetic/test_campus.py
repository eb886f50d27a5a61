"""The campus: as large as asked for, whole or not there in every format, the same for a seed; the product reads it."""

from __future__ import annotations

import gc
import json
import struct
import weakref
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from tlsplan.commands.scene import command

from planner_core.coverage.survey import make_survey
from planner_core.errors import RequirementError
from planner_core.model import PlanSettings, Scene
from planner_core.positions.free_space import free_space
from planner_core.positions.reach import reachability
from planner_core.progress import ProgressEvent
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from scenes_synthetic import basement, campus, stream
from scenes_synthetic.campus import PAVILION_M2, Campus, campus_parts, write_campus, write_pavilions
from scenes_synthetic.model import SyntheticScene
from scenes_synthetic.stream import STREAM_FORMATS

pytestmark = pytest.mark.slow

SMALL = 150_000
"""One pavilion and a park."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("campus")


@pytest.fixture(scope="module", params=STREAM_FORMATS)
def written(request: pytest.FixtureRequest, folder: Path) -> tuple[Path, Campus]:
    """A small campus in every format it is written in."""
    path = folder / f"small{request.param}"
    return path, write_campus(path, n_triangles=SMALL)


def extents_m(scene: Scene) -> np.ndarray:
    return np.array([scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)]) + scene.offset_m


def group_of_triangle(scene: Scene) -> np.ndarray:
    """The building that each triangle is of, by the names of its elements."""
    return np.array([element.name.split(":")[0] for element in scene.elements])[scene.element_of_triangle]


def test_campus_loads_with_the_triangles_that_were_counted(written: tuple[Path, Campus]) -> None:
    path, made = written
    assert 0 <= SMALL - made.n_triangles < 12
    assert [building.name for building in made.buildings] == ["basement 1"]
    scene = load_scene(path)
    assert scene.n_triangles == made.n_triangles
    assert scene.report.warnings == ()
    np.testing.assert_allclose(extents_m(scene), made.extents_m, atol=1e-5)


def test_campus_of_a_seed_is_the_same_file_and_of_another_is_not(written: tuple[Path, Campus], tmp_path: Path) -> None:
    path, _ = written
    again, other = tmp_path / path.name, tmp_path / f"other{path.suffix}"
    write_campus(again, n_triangles=SMALL)
    write_campus(other, n_triangles=SMALL, seed=1)
    assert again.read_bytes() == path.read_bytes()
    assert other.read_bytes() != path.read_bytes()


def test_names_say_the_building_where_the_format_has_names(folder: Path, written: tuple[Path, Campus]) -> None:
    path, _ = written
    names = [element.name for element in load_scene(path).elements]
    if path.suffix in (".obj", ".glb"):
        assert "basement 1: Base slab" in names
        assert names[-1] == "Park: Ground"
    elif path.suffix == ".usdz":
        assert "/campus/basement_1/Base_slab" in names
        assert names[-1] == "/campus/Park/Ground"
    else:
        assert len(names) == 1


@pytest.fixture(scope="module")
def three(folder: Path) -> tuple[Scene, Campus]:
    """Three pavilions, loaded from a format with names."""
    path = folder / "three.glb"
    made = write_campus(path, n_triangles=450_000)
    return load_scene(path), made


def test_buildings_stand_where_it_says_and_apart_from_each_other_and_the_park(three: tuple[Scene, Campus]) -> None:
    scene, made = three
    assert len(made.buildings) == 3
    group = group_of_triangle(scene)
    corners = scene.vertices_m[scene.triangles] + scene.offset_m
    boxes = []
    for building in made.buildings:
        of_it = corners[group == building.name]
        assert len(of_it) == building.n_triangles
        boxes.append((of_it.min(axis=(0, 1)), of_it.max(axis=(0, 1))))
        assert boxes[-1][0] == pytest.approx(building.at_m, abs=1e-5)
    names = np.array([element.name for element in scene.elements])[scene.element_of_triangle]
    trees = corners[np.char.startswith(names, "Park: Trees")]
    boxes.append((trees.min(axis=(0, 1)), trees.max(axis=(0, 1))))
    for i, (low_a, high_a) in enumerate(boxes):
        for low_b, high_b in boxes[i + 1 :]:
            assert (np.minimum(high_a, high_b)[:2] < np.maximum(low_a, low_b)[:2]).any()


@pytest.mark.slow
def test_floors_of_the_buildings_are_found(tmp_path: Path) -> None:
    path = tmp_path / "campus.ply"
    made = write_campus(path, n_triangles=700_003)
    assert [building.name for building in made.buildings] == ["school 1", "basement 2"]
    assert made.buildings[0].storeys_m == pytest.approx([0.4 + 4.4 * storey for storey in range(5)])
    scene = load_scene(path)
    floors = find_floors(scene)
    assert floors.warnings == ()
    found = np.array([floor.elevation_m + scene.offset_m[2] for floor in floors.floors])
    for building in made.buildings:
        for elevation in building.storeys_m:
            assert np.abs(found - elevation).min() < 0.15, f"{building.name} at {elevation}, found {found}"
    total = sum(floor.ground_area_m2 for floor in floors.floors)
    truth = sum(building.floor_area_m2 for building in made.buildings)
    # Without what stands on the floors and below stairs; with roofs and the ground near by, at most as much again.
    assert 0.7 * truth < total < 2 * truth


def test_floor_areas_are_those_of_the_buildings_themselves(three: tuple[Scene, Campus]) -> None:
    _, made = three
    truth = sum(basement.build().truth.floor_area_m2.values())
    assert [building.floor_area_m2 for building in made.buildings] == pytest.approx([truth] * 3)


def test_parts_are_those_of_the_file(written: tuple[Path, Campus]) -> None:
    _, made = written
    parts = list(campus_parts(SMALL))
    assert sum(len(part.solid.triangles) for part in parts) == made.n_triangles
    bounds = np.array([part.solid.bounds_m for part in parts])
    np.testing.assert_array_equal([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)], made.extents_m)


@pytest.mark.parametrize("suffix", STREAM_FORMATS)
def test_interrupted_campus_leaves_what_was_there_and_nothing_else(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"campus{suffix}"
    path.write_bytes(b"before")

    def interrupt(event: ProgressEvent) -> None:
        if event.done > SMALL // 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_campus(path, n_triangles=SMALL, progress=interrupt)
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]


def test_progress_rises_to_the_end_and_names_the_building(tmp_path: Path) -> None:
    events: list[ProgressEvent] = []
    write_campus(tmp_path / "campus.ply", n_triangles=SMALL, progress=events.append)
    done = [event.done for event in events]
    assert done == sorted(done)
    assert done[-1] == SMALL
    assert {event.total for event in events} == {SMALL}
    assert {event.note for event in events} >= {"basement 1", "Park"}


@pytest.mark.parametrize("n_buildings", [1, 2, 4, 9, 30, 1000])
def test_plots_make_about_a_square_and_hold_one_building_each(n_buildings: int) -> None:
    plots = [campus._plot(number) for number in range(n_buildings)]
    assert len(set(plots)) == n_buildings
    assert min(min(plot) for plot in plots) == 0
    assert max(max(plot) for plot in plots) == np.ceil(np.sqrt(n_buildings)) - 1


def test_campus_keeps_no_building_once_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory is bounded: whenever a building is begun, none of those before lives any more."""
    alive: list[weakref.ref[SyntheticScene]] = []
    most = 0

    def build(*, seed: int) -> SyntheticScene:
        nonlocal most
        gc.collect()
        most = max(most, sum(ref() is not None for ref in alive))
        made = basement.build(seed=seed)
        alive.append(weakref.ref(made))
        return made

    kinds: tuple[tuple[Callable[..., SyntheticScene], int], ...] = ((build, 137_000),)
    monkeypatch.setattr(campus, "_KINDS", kinds)
    made = write_campus(tmp_path / "campus.glb", n_triangles=420_000)
    assert len(made.buildings) == len(alive) == 3
    assert most <= 1


def test_glb_says_its_own_sizes(folder: Path) -> None:
    path = folder / "sizes.glb"
    write_campus(path, n_triangles=SMALL)
    content = path.read_bytes()
    assert struct.unpack_from("<4sII", content) == (b"glTF", 2, len(content))
    n_text, kind = struct.unpack_from("<I4s", content, 12)
    assert (kind, n_text % 4) == (b"JSON", 0)
    assert struct.unpack_from("<I4s", content, 20 + n_text) == (len(content) - 28 - n_text, b"BIN\0")
    tree = json.loads(content[20 : 20 + n_text])
    roots = [tree["nodes"][node]["name"] for node in tree["scenes"][0]["nodes"]]
    assert roots == ["basement 1", "Park"]


def test_usdz_is_a_package_without_compression_or_time_and_aligned(folder: Path) -> None:
    path = folder / "package.usdz"
    write_campus(path, n_triangles=SMALL)
    content = path.read_bytes()
    with zipfile.ZipFile(path) as package:
        assert package.testzip() is None
        entries = package.infolist()
    assert [entry.filename for entry in entries] == ["root.usda", "group_1.usdc", "group_2.usdc"]
    for entry in entries:
        assert entry.compress_type == zipfile.ZIP_STORED
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        n_name, n_extra = struct.unpack_from("<HH", content, entry.header_offset + 26)
        assert (entry.header_offset + 30 + n_name + n_extra) % 64 == 0, entry.filename


def test_sizes_and_files_that_cannot_be_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(RequirementError, match="expected 150000"):
        write_campus(tmp_path / "campus.ply", n_triangles=1000)
    with pytest.raises(RequirementError, match="expected 150000"):
        campus_parts(1000)
    with pytest.raises(RequirementError, match=r"expected one of \.ply, \.obj, \.glb, \.usdz"):
        write_campus(tmp_path / "campus.ifc", n_triangles=200_000)
    with pytest.raises(RequirementError, match=r"\.glb: got 16\.8 GiB or more, expected at most the 4 GiB"):
        write_campus(tmp_path / "campus.glb", n_triangles=1_000_000_000)
    with pytest.raises(RequirementError, match=r"\.usdz: got 5\.6 GiB or more, expected at most the 2 GiB"):
        write_campus(tmp_path / "campus.usdz", n_triangles=1_000_000_000)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("suffix", "most_bytes"), [(".glb", 2_750_000), (".usdz", 950_000)])
def test_a_file_that_grows_too_large_while_it_is_written_is_refused(
    suffix: str, most_bytes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(stream._MOST_BYTES, suffix, most_bytes)  # just more than the estimate
    with pytest.raises(RequirementError, match="fewer triangles"):
        write_campus(tmp_path / f"campus{suffix}", n_triangles=SMALL)
    assert list(tmp_path.iterdir()) == []


def test_command_writes_a_campus_shows_progress_and_gives_other_scenes_no_size(tmp_path: Path) -> None:
    path = tmp_path / "campus.ply"
    arguments = ["campus", "--triangles", "150000", "-o", str(path)]
    done = CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert done.exit_code == 0
    assert "writing: 150000 of 150000" in done.stderr
    assert done.stdout == f"wrote {path}: 1 building, {load_scene(path).n_triangles} triangles\n"
    quiet = CliRunner().invoke(command, [*arguments, "--overwrite", "--quiet"], catch_exceptions=False)
    assert (quiet.exit_code, quiet.stdout, quiet.stderr) == (0, "", "")
    refused = CliRunner().invoke(command, ["house", "--triangles", "150000", "-o", str(tmp_path / "house.ply")])
    assert isinstance(refused.exception, RequirementError)
    assert not (tmp_path / "house.ply").exists()


@pytest.mark.parametrize("n", [1, 5])
def test_bare_pavilions_have_the_floor_area_that_is_told_and_rooms_that_hang_together(n: int, tmp_path: Path) -> None:
    path = tmp_path / "pavilions.ply"
    assert write_pavilions(path, n_pavilions=n) == n * PAVILION_M2
    scene = load_scene(path)
    assert scene.report.warnings == ()
    survey = make_survey(scene, PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0))
    (floor,) = survey.floors
    # The slabs below the walls are in it: 10.8 m squares.
    assert floor.ground_area_m2 == pytest.approx(n * 10.8**2, rel=0.05)
    regions = [region for region in reachability(survey, free_space(survey)).regions if region.area_m2 > 1.0]
    assert len(regions) == n
    assert all(region.reached and 0.9 * PAVILION_M2 < region.area_m2 < 1.1 * PAVILION_M2 for region in regions)


def test_none_of_the_pavilions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequirementError, match="pavilions: got 0, expected 1 or more"):
        write_pavilions(tmp_path / "none.ply", n_pavilions=0)
