"""Several files as one scene: a house split by trade, moved files, the same file or element twice, odd storeys."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.errors import SceneError
from planner_core.model import Element, Georeference, Scene, SceneSource, Storey
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.federation import federated
from planner_core.scene.floors import find_floors
from planner_core.scene.load import LoadOptions, load_scene
from tests.reality_files import reality
from tests.scene.conftest import native_readers_here

STRUCTURE = ("IfcSlab", "IfcRoof", "IfcStair", "IfcRailing")
ARCHITECTURE = ("IfcWall", "IfcDoor", "IfcWindow")


def write_trades(folder: Path) -> list[Path]:
    """The house as three IFC files, a trade each; rooms are in the architect's."""
    house = scenes_synthetic.build("house")
    files = []
    for name, is_mine in (
        ("arch", lambda kind: kind in ARCHITECTURE),
        ("struct", lambda kind: kind in STRUCTURE),
        ("mep", lambda kind: kind not in ARCHITECTURE + STRUCTURE),
    ):
        parts = tuple(part for part in house.parts if is_mine(part.kind))
        rooms = house.rooms if name == "arch" else ()
        files.append(scenes_synthetic.write(replace(house, parts=parts, rooms=rooms), folder / f"{name}.ifc"))
    return files


@pytest.fixture(scope="module")
def trades(tmp_path_factory) -> list[Path]:
    return write_trades(tmp_path_factory.mktemp("trades"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Scene:
    folder = tmp_path_factory.mktemp("whole")
    with native_readers_here():
        return load_scene(scenes_synthetic.write(scenes_synthetic.build("house"), folder / "house.ifc"))


@pytest.fixture(scope="module")
def together(trades) -> Scene:
    with native_readers_here():
        return load_scene(trades)


def rows_of(scene: Scene) -> list[tuple[object, ...]]:
    """Every triangle by its corners' places, its element and what it does to beams, in an order of their own."""
    corners = scene.vertices_m[scene.triangles] + scene.offset_m
    optics = scene.optics_of_triangle if scene.optics_of_triangle is not None else np.zeros(scene.n_triangles)
    names = [scene.elements[e].name for e in scene.element_of_triangle.tolist()]
    return sorted(zip(map(np.ndarray.tolist, corners.reshape(-1, 9)), names, optics.tolist(), strict=True))


def box_scene(
    low=(0.0, 0.0, 0.0),
    high=(10.0, 8.0, 3.0),
    *,
    file="box.ifc",
    name="Box",
    ident="",
    storeys=((0.0, "Ground"),),
    georeference: Georeference | None = None,
    turn_rad: float = 0.0,
) -> Scene:
    """A box as the scene of a file: 12 triangles, turned about the origin."""
    corners = np.array([[x, y, z] for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])])
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    corners = corners @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    triangles = np.array([[a, b, c] for a, b, c, _ in quads] + [[a, c, d] for a, _, c, d in quads])
    scene = scene_from_arrays(
        corners,
        triangles,
        elements=[Element(name, "IfcWall", ident or file, 0 if storeys else -1)],
        storeys=[Storey(called, called, z) for z, called in storeys],
        source=SceneSource(Path(file), file, "ifc", "metre", 1.0, "Z"),
    )
    return replace(scene, georeference=georeference)  # fmt: skip


def on_map(east_m: float, north_m: float, height_m: float = 0.0, turn_rad: float = 0.0, **more) -> Georeference:
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    rows = ((c, -s, 0.0, east_m), (s, c, 0.0, north_m), (0.0, 0.0, 1.0, height_m), (0.0, 0.0, 0.0, 1.0))
    return Georeference(operation="IfcMapConversion", to_map=rows, **more)


# ---------------------------------------------------------------------------------------- a house by trade
@pytest.mark.slow
def test_trades_together_are_the_whole_house(together, whole):
    scene = together
    assert rows_of(scene) == rows_of(whole)
    assert [(s.name, s.elevation_m) for s in scene.storeys] == [(s.name, s.elevation_m) for s in whole.storeys]
    assert scene.report.warnings == whole.report.warnings == ()
    assert scene.report.n_faces_read == whole.report.n_faces_read
    storey_of = {e.name: whole.storeys[e.storey].name for e in whole.elements}
    assert {e.name: scene.storeys[e.storey].name for e in scene.elements} == storey_of


@pytest.mark.slow
def test_elements_know_their_files(together, trades):
    scene = together
    assert [source.path for source in scene.sources] == trades
    assert scene.title == "arch.ifc and 2 more files"
    for number, element in enumerate(scene.elements):
        expected = {"IfcWall": "arch.ifc", "IfcSlab": "struct.ifc", "IfcFurniture": "mep.ifc"}.get(element.kind)
        assert expected is None or scene.file_of(number) == expected
    assert load_scene(trades[1]).file_of(0) == ""


@pytest.mark.slow
def test_files_in_any_order_give_the_same_floors_and_rooms(together, trades, whole):
    expected = [(f.name, f.elevation_m, round(f.ground_area_m2, 6)) for f in find_floors(whole).floors]
    for scene in (together, load_scene(trades[::-1])):
        assert [(f.name, f.elevation_m, round(f.ground_area_m2, 6)) for f in find_floors(scene).floors] == expected
        assert sorted((r.name, scene.storeys[r.storey].name) for r in scene.rooms) == sorted(
            (r.name, whole.storeys[r.storey].name) for r in whole.rooms
        )


@pytest.mark.slow
def test_doors_and_glass_are_taken_alike_in_all_files(trades, tmp_path, whole):
    options = LoadOptions(glass="stop", doors="open")
    house = scenes_synthetic.write(scenes_synthetic.build("house"), tmp_path / "house.ifc")
    scene, expected = load_scene(trades, options=options), load_scene(house, options=options)
    assert expected.report.n_doors_open > 0
    assert rows_of(scene) == rows_of(expected)
    assert scene.report.n_doors_open == expected.report.n_doors_open
    assert scene.report.glass_area_m2 == pytest.approx(expected.report.glass_area_m2)


@pytest.mark.slow
def test_formats_and_units_may_differ(trades, tmp_path, whole):
    house = scenes_synthetic.build("house")
    services = [part for part in house.parts if part.kind not in ARCHITECTURE + STRUCTURE]
    in_mm = replace(
        house,
        parts=tuple(services),
        scene=sub_scene(house, services),
        frame=replace(house.frame, metres_per_unit=0.001),
    )
    mep = scenes_synthetic.write(in_mm, tmp_path / "mep.obj")
    options = [LoadOptions(), LoadOptions(), LoadOptions(metres_per_unit=0.001)]
    scene = load_scene([*trades[:2], mep], options=options)
    assert scene.n_triangles == whole.n_triangles
    np.testing.assert_allclose(scene.vertices_m.min(axis=0), whole.vertices_m.min(axis=0), atol=1e-9)
    assert [source.given_metres_per_unit for source in scene.sources] == [None, None, 0.001]


def sub_scene(house, parts) -> Scene:
    names = {part.name for part in parts}
    keep = [i for i, element in enumerate(house.scene.elements) if element.name in names]
    mine = np.isin(house.scene.element_of_triangle, keep)
    renumbered = np.searchsorted(keep, house.scene.element_of_triangle[mine]).astype(np.int32)
    return replace(
        house.scene,
        triangles=house.scene.triangles[mine],
        element_of_triangle=renumbered,
        elements=tuple(house.scene.elements[i] for i in keep),
        optics_of_triangle=None,
    )


# -------------------------------------------------------------------------------------------------- twice
def test_a_file_given_twice_is_read_once(trades, tmp_path):
    _, struct, mep = trades
    copy = tmp_path / "copy.ifc"
    copy.write_bytes(struct.read_bytes())
    scene = load_scene([struct, mep, struct, copy])
    assert [source.path for source in scene.sources] == [struct, mep]
    assert rows_of(scene) == rows_of(load_scene([struct, mep]))
    assert scene.report.warnings == (
        f"{struct}: was given a second time: it is read once.",
        f"{copy}: is the same file as {struct} and was given a second time: it is read once.",
    )
    alone = load_scene([struct, copy])
    assert alone.sources == load_scene(struct).sources
    assert alone.report.warnings[0].startswith(f"{copy}: is the same file as")


def test_an_element_that_two_files_have_counts_once():
    arch = box_scene(file="arch.ifc", ident="1abc")
    wider = box_scene((10.0, 1.0, 0.0), (12.0, 8.0, 3.0), file="struct.ifc", name="Wall", ident="2abc")
    again = box_scene((0.0, 0.0, 0.0004), (10.0, 8.0, 3.0), file="struct.ifc", name="Box", ident="other")
    struct = federated([again, replace(wider, source=again.source)])
    assert len(struct.elements) == 2
    scene = federated([arch, replace(struct, further_sources=())])
    assert [(e.name, e.file) for e in scene.elements] == [("Box", 0), ("Wall", 1)]
    assert scene.n_triangles == 24 and scene.report.n_faces_read == 36 and scene.report.n_duplicate == 12
    assert scene.report.warnings[-1] == "struct.ifc: 1 element that an earlier file has, too, counts once (Box)."


def test_a_file_of_nothing_but_copies_is_told():
    scene = federated([box_scene(file="a.ifc"), box_scene(file="b.ifc")])
    assert scene.n_triangles == 12
    assert scene.report.warnings[-1] == (
        "b.ifc: all of its elements are in the files before it: they count once; leave it out."
    )


def test_one_id_for_two_shapes_is_told_and_both_stay():
    scene = federated(
        [box_scene(file="a.ifc", ident="3x"), box_scene((0.1, 0.1, 0.1), (9, 7, 2), file="b.ifc", ident="3x")]
    )
    assert scene.n_triangles == 24
    (line,) = scene.report.warnings
    assert line.startswith("b.ifc: the GlobalId 3x of Box stands for another shape in a.ifc: both count;")


# ------------------------------------------------------------------------------------------------- frames
def test_files_on_one_map_are_brought_together():
    """The second file is the same building, drawn turned by 30 degrees about an origin of its own."""
    turn = math.radians(30.0)
    here, there = on_map(458_870.0, 5_438_260.0, 110.0), on_map(458_870.0, 5_438_260.0, 108.0, turn_rad=turn)
    arch = box_scene(file="arch.ifc", georeference=here)
    mine = box_scene(
        (2.0, 1.0, 3.0),
        (8.0, 7.0, 5.0),
        file="roof.ifc",
        storeys=((2.0, "Ground"),),
        georeference=there,
        turn_rad=-turn,
    )
    scene = federated([arch, mine])
    roof = scene.vertices_m[scene.triangles[scene.element_of_triangle == 1]].reshape(-1, 3)
    np.testing.assert_allclose([roof.min(axis=0), roof.max(axis=0)], [[2.0, 1.0, 1.0], [8.0, 7.0, 3.0]], atol=1e-6)
    assert [(s.name, s.elevation_m) for s in scene.storeys] == [("Ground", 0.0)]
    assert scene.georeference is here
    (line,) = scene.report.warnings
    assert line.startswith("roof.ifc: is moved by") and "turned by 30.00 degrees" in line


def test_grid_scale_is_no_shape_of_the_building():
    here = on_map(0.0, 0.0)
    scaled = tuple(tuple(v * 0.9996 if k < 3 else v for k, v in enumerate(row)) for row in here.to_map)
    scene = federated(
        [
            box_scene(file="a.ifc", georeference=here),
            box_scene((0, 0, 3), (10, 8, 6), file="b.ifc", georeference=replace(here, to_map=scaled)),
        ]
    )
    upper = scene.vertices_m[scene.triangles[scene.element_of_triangle == 1]].reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(upper, axis=0), [10.0, 8.0, 3.0], atol=1e-9)


def test_a_file_without_map_conversion_keeps_its_coordinates_and_is_told():
    scene = federated(
        [box_scene(file="a.ifc"), box_scene((0, 0, 3), (10, 8, 6), file="b.ifc", georeference=on_map(500_000.0, 5e6))]
    )
    assert scene.vertices_m.max(axis=0).tolist() == [10.0, 8.0, 6.0]
    assert scene.georeference is not None and scene.georeference.to_map is not None
    assert scene.report.warnings == ("a.ifc: without a map conversion, the origin is taken to be that of b.ifc.",)


def test_another_coordinate_system_or_true_north_is_told():
    a = box_scene(file="a.ifc", georeference=on_map(0.0, 0.0, crs_name="EPSG:25832"))
    b = box_scene((0, 0, 3), (10, 8, 6), file="b.ifc", georeference=on_map(0.0, 0.0, crs_name="EPSG:25833"))
    assert "its map is EPSG:25833, that of a.ifc is EPSG:25832" in federated([a, b]).report.warnings[0]
    same = replace(b, georeference=on_map(0.0, 0.0, crs_name="epsg: 25832"))
    assert federated([a, same]).report.warnings == ()
    north = [Georeference(true_north=(math.sin(a), math.cos(a))) for a in (0.0, math.radians(20.0))]
    c, d = (replace(scene, georeference=told) for scene, told in zip((a, b), north, strict=True))
    assert "b.ifc: its true north is 20.0 degrees off that of a.ifc" in federated([c, d]).report.warnings[0]


def test_files_far_from_origin_stay_exact_and_are_told_once():
    low, high = (458_870.0, 5_438_260.0, 110.0), (458_880.0, 5_438_268.0, 113.0)
    above = ((*low[:2], 113.0), (*high[:2], 116.0))
    scene = federated([box_scene(low, high, file="a.ifc"), box_scene(*above, file="b.ifc")])
    np.testing.assert_array_equal(scene.vertices_m.min(axis=0) + scene.offset_m, low)
    np.testing.assert_array_equal(scene.vertices_m.max(axis=0) + scene.offset_m, above[1])
    assert len([line for line in scene.report.warnings if "far from its origin" in line]) == 1
    assert scene.n_triangles == 22  # the face between the two is one: both triangles of it are there once


def test_a_file_that_touches_no_other_is_told():
    near = box_scene((60.0, 0.0, 0.0), (70.0, 8.0, 3.0), file="annex.ifc", ident="2")
    (line,) = federated([box_scene(file="a.ifc"), near]).report.warnings
    assert line.startswith("annex.ifc: lies 50.0 m away from a.ifc (middle to middle x 60.0, y 0.0, z 0.0 m), expected")
    assert "same origin" in line


def test_a_file_a_kilometre_away_is_refused_with_the_remedy():
    far = box_scene((458_870.0, 0.0, 0.0), (458_880.0, 8.0, 3.0), file="survey.ifc", ident="3")
    beside = box_scene((10.0, 0.0, 0.0), (20.0, 8.0, 3.0), file="b.ifc", ident="2")
    for scenes in ([box_scene(file="a.ifc"), beside, far], [far, beside, box_scene(file="a.ifc")]):
        with pytest.raises(SceneError, match=r"^survey.ifc: lies 458850.0 m away from the other files .* same origin"):
            federated(scenes)


def test_a_file_of_an_impossible_size_is_refused_by_its_own_name():
    wrong = box_scene(high=(10_000.0, 8_000.0, 3_000.0), file="mm.obj")
    with pytest.raises(SceneError, match=r"^mm.obj: read in metres it measures 10000 x 8000 x 3000 m"):
        federated([box_scene(file="a.ifc"), wrong])


# ------------------------------------------------------------------------------------------------ storeys
def storeys_of(*files) -> tuple[list[tuple[str, float]], tuple[str, ...], Scene]:
    boxes = [
        box_scene((0, 0, 3.0 * i), (10, 8, 3.0 * i + 3), file=f"{'abc'[i]}.ifc", ident=str(i), storeys=storeys)
        for i, storeys in enumerate(files)
    ]
    scene = federated(boxes)
    return [(s.name, s.elevation_m) for s in scene.storeys], scene.report.warnings, scene


def test_storeys_are_matched_by_height_and_name_and_differences_told():
    names, told, _ = storeys_of(
        ((0.0, "Ground"), (3.0, "First")), ((-0.15, "SSL 00"), (2.9, "First"), (6.0, "Roof")), ((0.01, "ground"),)
    )
    assert names == [("Ground", 0.0), ("First", 3.0), ("Roof", 6.0)]
    assert told == (
        "b.ifc: storey SSL 00 is at -0.150 m and Ground in a.ifc at 0.000 m: taken as one, and 1 more storeys differ.",
    )


def test_a_storey_of_the_same_name_at_another_height_stays_apart_and_is_told():
    names, told, scene = storeys_of(((0.0, "Ground"), (3.0, "First")), ((0.0, "Ground"), (3.9, "First")))
    assert names == [("Ground", 0.0), ("First", 3.0), ("First", 3.9)]
    assert told == ("b.ifc: storey First is at 3.900 m and in a.ifc at 3.000 m: kept as two; check the files.",)
    assert [e.storey for e in scene.elements] == [0, 0]


def test_storeys_of_one_file_stay_apart():
    names, _, _ = storeys_of(((0.0, "Ground"),), ((0.0, "Floor"), (0.15, "Screed")))
    assert names == [("Ground", 0.0), ("Screed", 0.15)]


def test_storeys_all_at_one_height_are_no_storeys():
    names, told, scene = storeys_of(((0.0, "Ground"), (3.0, "First")), ((0.0, "1e"), (0.0, "2e")))
    assert names == [("Ground", 0.0), ("First", 3.0)]
    assert [e.storey for e in scene.elements] == [0, -1]
    assert told[0].startswith("b.ifc: all its 2 storeys are at 0.00 m")
    only, _, _ = storeys_of(((0.0, "1e"), (0.0, "2e")), ())
    assert only == [("1e", 0.0), ("2e", 0.0)]


@pytest.mark.slow
def test_a_shift_in_height_common_to_all_storeys_is_refused_by_its_amount():
    with pytest.raises(SceneError) as caught:
        load_scene([reality("house_arch.ifc"), reality("house_struct_1m_up.ifc")])
    assert "house_struct_1m_up.ifc: its 2 storeys EG, OG all lie 1.000 m above" in str(caught.value)
    assert "house_arch.ifc" in str(caught.value) and "move it by -1.000 m" in str(caught.value)


@pytest.mark.parametrize(
    ("shift_m", "told"),
    [(1.0, "1.000 m above"), (-0.62, "0.620 m below"), (112.4, "112.400 m above"), (0.3048 * 12, "3.658 m above")],
)
def test_a_common_shift_of_any_size_is_refused(shift_m, told):
    storeys = ((0.0, "EG"), (3.0, "OG"), (6.0, "DG"))
    moved = tuple((z + shift_m, name.lower()) for z, name in storeys)
    files = [
        box_scene(file="a.ifc", storeys=storeys),
        box_scene(file="b.ifc", storeys=storeys[:1]),
        box_scene((0, 0, shift_m), (10, 8, shift_m + 3), file="c.ifc", storeys=(*moved[:2], (shift_m - 3, "Keller"))),
    ]
    with pytest.raises(SceneError, match=f"c.ifc: its 2 storeys eg, og all lie {told} those of .* in a.ifc"):
        federated(files)


@pytest.mark.parametrize(
    ("storeys", "low"),
    [
        pytest.param(((1.2, "EG"), (4.2, "OG")), (10.0, 0.0, 1.2), id="a house beside it on a slope"),
        pytest.param(((1.2, "EG"),), (0.0, 0.0, 0.0), id="one storey in common"),
        pytest.param(((1.2, "EG"), (3.9, "OG")), (0.0, 0.0, 0.0), id="two amounts"),
        pytest.param(((-0.15, "EG"), (2.85, "OG")), (0.0, 0.0, 0.0), id="raw slabs and finished floors"),
    ],
)
def test_storeys_of_the_same_names_at_other_heights_are_no_common_shift(storeys, low):
    x, y, z = low
    other = box_scene(low, (x + 10, y + 8, z + 3), file="b.ifc", storeys=storeys)
    federated([box_scene(storeys=((0.0, "EG"), (3.0, "OG"))), other])


# ---------------------------------------------------------------------------------------------- arguments
def test_options_must_fit_the_files(trades):
    with pytest.raises(SceneError, match="got options for 2 files, expected 3"):
        load_scene(trades, options=[LoadOptions(), LoadOptions()])
    with pytest.raises(SceneError, match="different glass, doors or classes"):
        load_scene(trades[:2], options=[LoadOptions(), LoadOptions(glass="stop")])
    with pytest.raises(SceneError, match="no scene file"):
        load_scene([])


# ------------------------------------------------------------------------------------------ a real building
_TRADES = (
    "kalkzandsteen", "breedplaatvloeren", "houten-kozijnen", "kanaalplaatvloer", "kapconstructie", "prefab-vebo",
    "staal",
)  # fmt: skip


@pytest.mark.campaign
def test_eight_trades_of_schependomlaan_are_one_building(corpus_file):
    names = [f"ifc-schependomlaan-{trade}-archicad18.ifc" for trade in _TRADES]
    files = [corpus_file(name) for name in (*names, "ifc-schependomlaan-linden-frames-tekla20.ifc")]
    check_schependomlaan(load_scene(files), n_files=8)


@pytest.mark.slow
def test_walls_and_slabs_of_schependomlaan_are_one_building(corpus_file):
    names = [f"ifc-schependomlaan-{trade}-archicad18.ifc" for trade in (_TRADES[0], _TRADES[1], _TRADES[3])]
    check_schependomlaan(load_scene([corpus_file(name) for name in names]), n_files=3)


def check_schependomlaan(scene: Scene, *, n_files: int) -> None:
    """Walls of sand-lime brick, slabs of two other files; every file of ArchiCAD has one mark at the origin."""
    assert [(s.name[:2], s.elevation_m) for s in scene.storeys] == [
        ("00", 0),
        ("01", 3),
        ("02", 6),
        ("03", 9),
        ("04", 12),
    ]
    floors = find_floors(scene).floors[:4]
    assert [f.origin for f in floors] == ["slab"] * 4
    np.testing.assert_allclose([f.elevation_m for f in floors], [0.0, 3.0, 6.0, 9.0], atol=0.1)
    assert len(scene.sources) == n_files
    assert sum(e.name == "ROOT nulpunt" for e in scene.elements) == 1
    for floor in floors:
        kinds = {scene.file_of(e) for e in set(scene.element_of_triangle[floor.ground_triangles].tolist())}
        assert not any("kalkzandsteen" in name for name in kinds)
        assert any("vloer" in name for name in kinds)


def test_small_parts_of_many_files_share_one_doubt_of_their_unit(tmp_path):
    for number in range(4):
        (tmp_path / f"part{number}.obj").write_text(f"v 0 0 0\nv 0.0{number + 1} 0 0\nv 0 0.01 0\nf 1 2 3\n")
    (tmp_path / "long.obj").write_text("v 0 0 0\nv 900 0 0\nv 0 900 0\nf 1 2 3\n")
    (tmp_path / "hall.obj").write_text("v 0 0 0\nv 20 0 0\nv 0 20 0\nf 1 2 3\n")
    names = ["hall.obj", "long.obj", *(f"part{number}.obj" for number in range(4))]
    scene = load_scene([tmp_path / name for name in names])
    doubts = [line for line in scene.report.warnings if "--units" in line]
    (line,) = doubts
    assert line.startswith("part0.obj, read in metres, is only 0.01 m long, and 3 more files are alike: ")
    assert "pass their unit, such as --units part0.obj=" in line
    told = [LoadOptions(metres_per_unit=1.0 if name.startswith("part") else None) for name in names]
    again = load_scene([tmp_path / name for name in names], options=told)
    assert not [line for line in again.report.warnings if "--units" in line]
