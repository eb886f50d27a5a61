"""Lists from the field: E57 poses, headerless CSV, and lists that are somewhere else."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.as_scanned.e57_poses import e57_poses, read
from planner_core.as_scanned.station_lists import read_actual
from planner_core.child_process import LostChildError
from planner_core.coordinates.request import FrameRequest
from planner_core.errors import RequirementError, StationListError
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from tests.reality_files import reality


def write_csv(path: Path, rows: list[tuple[str, np.ndarray]]) -> Path:
    lines = [f"{name},{','.join(repr(float(v)) for v in at)}" for name, at in rows]
    path.write_text("\n".join(["name,easting,northing,elevation", *lines]))
    return path


UPRIGHT, QUARTER = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.5**0.5, 0.0, 0.0, 0.5**0.5])


def write_e57(path: Path, poses: dict[str, np.ndarray], rotation: np.ndarray = UPRIGHT) -> Path:
    """Scans of three points each, with their poses, as pye57 writes them."""
    import pye57

    file = pye57.E57(str(path), mode="w")
    points = {f"cartesian{axis}": np.array([0.0, 1.0, 2.0]) for axis in "XYZ"}
    for name, at in poses.items():
        file.write_scan_raw(points, name=name, rotation=rotation, translation=at)
    file.close()
    return path


@pytest.mark.slow
def test_poses_of_an_e57_are_the_stations(source: PlanSource, tmp_path: Path) -> None:
    poses = {each.id: each.site_m for each in source.stations[:3]}
    actual = read_actual([write_e57(tmp_path / "scans.e57", poses)], source)
    assert actual.coordinates == "site"
    assert [each.id for each in actual.stations] == list(poses)
    for found, planned in zip(actual.stations, source.stations, strict=False):
        np.testing.assert_allclose(found.position_m, planned.position_m, atol=1e-6)
        assert not found.is_ground


@pytest.mark.slow
def test_several_files_are_one_list(source: PlanSource, tmp_path: Path) -> None:
    first, second = source.stations[:2]
    a = write_e57(tmp_path / "a.e57", {first.id: first.position_m})
    b = write_csv(tmp_path / "b.csv", [(second.id, second.position_m)])
    actual = read_actual([a, b], source)
    assert actual.coordinates == "scene"
    assert [each.id for each in actual.stations] == [first.id, second.id]
    with pytest.raises(StationListError, match="twice"):
        read_actual([a, a], source)


@pytest.mark.slow
def test_a_folder_of_e57_files_is_one_list(source: PlanSource, tmp_path: Path) -> None:
    for each in source.stations[:2]:
        write_e57(tmp_path / f"{each.id}.e57", {each.id: each.site_m})
    assert [each.id for each in read_actual([tmp_path], source).stations] == [each.id for each in source.stations[:2]]


@pytest.mark.slow
def test_scans_without_pose_are_refused(source: PlanSource, tmp_path: Path) -> None:
    from pye57 import libe57

    path = tmp_path / "raw.e57"
    file = libe57.ImageFile(str(path), "w")
    scans = libe57.VectorNode(file, True)
    scan = libe57.StructureNode(file)
    scans.append(scan)
    scan.set("name", libe57.StringNode(file, "Scan 1"))
    file.root().set("data3D", scans)
    file.close()
    with pytest.raises(StationListError, match=r"raw\.e57: scan 'Scan 1' has no pose.*registration"):
        read_actual([path], source)


@pytest.mark.parametrize("name", ["six_scans_one_pose.e57", "twelve_scans_identity.e57"])
def test_scans_that_lost_their_poses_are_refused(source: PlanSource, name: str) -> None:
    with pytest.raises(StationListError, match=r"the poses are missing: export the scans after registration"):
        read_actual([reality(name)], source)


@pytest.mark.slow
@pytest.mark.parametrize("n_files", [1, 3])
@pytest.mark.parametrize(
    ("at_m", "rotation", "n", "got"),
    [
        ([0.0, 0.0, 0.0], UPRIGHT, 3, "got 3 scans with the pose of no translation and no rotation"),
        ([0.0, 0.0, 0.0], QUARTER, 3, r"all 3 at one place, \(0.000, 0.000, 0.000\)"),  # level and compass kept
        ([458870.0, 5438260.0, 110.0], UPRIGHT, 3, "all 3 at one place"),  # of the site's origin alone
        ([0.0, 0.0, 0.0], UPRIGHT, 1, "got 1 scan with the pose of no translation and no rotation"),
    ],
)
def test_scans_of_one_pose_are_refused(
    source: PlanSource, tmp_path: Path, at_m: list[float], rotation: np.ndarray, n: int, got: str, n_files: int
) -> None:
    poses = {f"Setup {k}": np.array(at_m) for k in range(n)}
    lists = [poses] if n_files == 1 else [{name: at} for name, at in poses.items()]
    paths = [write_e57(tmp_path / f"{k}.e57", each, rotation) for k, each in enumerate(lists)]
    with pytest.raises(StationListError, match=f"{got}.*poses are missing.*registration"):
        read_actual(paths, source)


def test_a_list_of_one_place_is_refused(source: PlanSource, tmp_path: Path) -> None:
    first = source.stations[0].position_m
    with pytest.raises(StationListError, match="all 2 at one place"):
        read_actual([write_csv(tmp_path / "one.csv", [("A", first), ("B", first + 0.0004)])], source)


def test_a_lost_pose_among_good_ones_is_named(source: PlanSource, tmp_path: Path) -> None:
    poses = {each.id: each.position_m for each in source.stations[:4]} | {"Setup 5": np.zeros(3)}
    path = write_e57(tmp_path / "scans.e57", poses)
    with pytest.raises(StationListError, match=r"got Setup 5 of 5 with the pose of no translation.*leave these out"):
        read_actual([path], source)


@pytest.mark.slow
def test_the_first_scan_of_a_model_in_its_coordinates_stands_at_the_origin(source: PlanSource, tmp_path: Path) -> None:
    """A model that was made from scans has the first one's coordinates: its pose is right, and at the plan."""
    near_origin = source.stations[0]
    moved = replace(source, stations=tuple(replace(each, position_m=each.position_m - near_origin.position_m)
                                           for each in source.stations))  # fmt: skip
    path = write_e57(tmp_path / "scans.e57", {each.id: each.position_m for each in moved.stations[:3]})
    actual = read_actual([path], moved, coordinates="scene")
    assert [each.is_identity for each in actual.stations] == [True, False, False]


def test_a_plan_without_stations_is_compared_with_nothing(source: PlanSource, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "list.csv", [("A", np.zeros(3)), ("B", np.ones(3))])
    with pytest.raises(StationListError, match="the plan has none"):
        read_actual([path], replace(source, stations=()))


def test_a_file_that_is_no_e57_is_refused_in_one_line(source: PlanSource, tmp_path: Path) -> None:
    (tmp_path / "bad.e57").write_bytes(b"not an E57 file" * 100)
    with pytest.raises(StationListError, match=r"bad\.e57: can't be read as E57") as caught:
        read_actual([tmp_path / "bad.e57"], source)
    assert "\n" not in str(caught.value)
    with pytest.raises(StationListError, match="no such file"):
        read_actual([tmp_path / "none.e57"], source)


def test_an_e57_without_scans_is_refused(source: PlanSource, tmp_path: Path) -> None:
    from pye57 import libe57

    libe57.ImageFile(str(tmp_path / "images.e57"), "w").close()
    with pytest.raises(StationListError, match=r"images\.e57: got no scans, expected some"):
        read_actual([tmp_path / "images.e57"], source)


def test_an_e57_that_ends_its_library_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*args: Any, **options: Any) -> None:
        raise LostChildError("crashed (segmentation fault)", str(tmp_path / "b.e57"), ())

    paths = [write_e57(tmp_path / name, {"A": np.zeros(3)}) for name in ("a.e57", "b.e57")]
    monkeypatch.setattr("planner_core.child_process.run_isolated", fail)
    with pytest.raises(StationListError, match=r"b\.e57: libE57Format crashed \(segmentation fault\), expected an E57"):
        e57_poses(paths)


def test_damaged_e57_is_refused(tmp_path: Path) -> None:
    """Every page of it has a checksum."""
    whole = write_e57(tmp_path / "whole.e57", {"A": np.arange(3.0), "B": np.ones(3)}).read_bytes()
    rng = random.Random(1)
    path = tmp_path / "damaged.e57"
    for number in range(200):
        at = rng.randrange(len(whole))
        path.write_bytes(whole[:at] if number % 5 == 0 else whole[:at] + rng.randbytes(3) + whole[at + 3 :])
        with pytest.raises(StationListError, match=r"damaged\.e57: can't be read as E57") as caught:
            read([str(path)])
        assert "\n" not in str(caught.value)


def test_a_list_500_km_away_is_refused_with_the_shift(source: PlanSource, tmp_path: Path) -> None:
    shift = np.array([300_000.0, 400_000.0, 0.0])
    rows = [(each.id, each.position_m + shift) for each in source.stations]
    with pytest.raises(
        StationListError,
        match=r"none of \d+ is near the plan.*km.*; all are shifted by the same 300000\.00, 400000\.00, 0\.00",
    ):
        read_actual([write_csv(tmp_path / "far.csv", rows)], source, coordinates="scene")
    with pytest.raises(StationListError, match=r"as scene coordinates and .* as site coordinates"):
        read_actual([tmp_path / "far.csv"], source)
    with pytest.raises(StationListError, match="all are shifted by the same"):
        read_actual([write_csv(tmp_path / "two.csv", rows[:2])], source, coordinates="scene")
    with pytest.raises(StationListError) as one:
        read_actual([write_csv(tmp_path / "one.csv", rows[:1])], source, coordinates="scene")
    assert "shifted" not in str(one.value)


def other_names(
    source: PlanSource, places: list[np.ndarray] | np.ndarray, seed: int = 5
) -> list[tuple[str, np.ndarray]]:
    """Places of the plan's stations under names of a crew's own, in an order of its own, decimetres off."""
    rng = np.random.default_rng(seed)
    off = rng.normal(0, 0.05, (len(source.stations), 3)) * (1, 1, 0.1)
    return [(f"scan {n}", places[k] + off[k]) for n, k in enumerate(rng.permutation(len(source.stations)).tolist())]


def test_a_list_of_other_names_500_km_away_is_recognised_by_its_shape(source: PlanSource, tmp_path: Path) -> None:
    n = len(source.stations)
    rows = other_names(source, [each.position_m + np.array([5e5, 0.0, 0.0]) for each in source.stations])
    with pytest.raises(StationListError) as caught:
        read_actual([write_csv(tmp_path / "far.csv", rows)], source)
    found = re.search(
        rf"by their shape (\d+) of {n} .* are shifted by the same (\S+), (\S+), (\S+) m from", str(caught.value)
    )
    assert found
    assert int(found[1]) >= n - 1
    assert [float(value) for value in found.groups()[1:]] == pytest.approx([5e5, 0.0, 0.0], abs=0.1)
    assert "from the plan's scene coordinates" in str(caught.value)


def test_reduced_site_coordinates_of_other_names_are_recognised(source: PlanSource, tmp_path: Path) -> None:
    less = np.array([458_000.0, 5_438_000.0, 100.0])
    rows = other_names(source, [each.site_m - less for each in source.stations])
    with pytest.raises(
        StationListError, match=r"by their shape .*from the plan's site coordinates: add the offset"
    ) as caught:
        read_actual([write_csv(tmp_path / "reduced.csv", rows)], source)
    found = re.search(r"by the same (\S+), (\S+), (\S+) m", str(caught.value))
    assert found
    assert [float(value) for value in found.groups()] == pytest.approx(-less, abs=0.1)


def test_the_way_that_a_turned_list_of_other_names_is_told_brings_it_to_the_plan(
    house_plan: Path, source: PlanSource, tmp_path: Path
) -> None:
    turn = np.exp(1j * np.deg2rad(33.0))
    plane = [complex(*each.position_m[:2]) * turn + complex(2_600_000.0, 1_200_000.0) for each in source.stations]
    places = [np.array([at.real, at.imag, each.position_m[2] + 400.0])
              for at, each in zip(plane, source.stations, strict=True)]  # fmt: skip
    path = write_csv(tmp_path / "turned.csv", other_names(source, places))
    with pytest.raises(StationListError, match=r"lie as planned, turned by 3[23]") as caught:
        read_actual([path], source)
    told = re.search(r"give --origin (\S+),(\S+),(\S+) --rotation (\S+)$", str(caught.value))
    assert told
    e, n, h, degrees = map(float, told.groups())
    asked = FrameRequest(origin_m=(e, n, h), rotation_rad=np.deg2rad(degrees))
    actual = read_actual([path], open_plan(house_plan, frame=asked))
    assert (actual.coordinates, actual.doubts) == ("site", ())
    planned = np.array([each.position_m for each in source.stations])
    away = [np.linalg.norm(planned - each.position_m, axis=1).min() for each in actual.stations]
    assert max(away) < 0.3


@pytest.mark.slow
def test_swapped_and_scaled_lists_of_other_names_elsewhere_are_recognised(source: PlanSource, tmp_path: Path) -> None:
    far = np.array([5e5, 1e5, 0.0])
    swapped = other_names(source, [(each.position_m + far)[[1, 0, 2]] for each in source.stations])
    with pytest.raises(StationListError, match=r"look swapped .*: exchanged, by their shape .* by the same") as caught:
        read_actual([write_csv(tmp_path / "swapped.csv", swapped)], source)
    found = re.search(r"by the same (\S+), (\S+), (\S+) m", str(caught.value))
    assert found
    assert [float(value) for value in found.groups()] == pytest.approx(far, abs=0.1)
    feet = [
        (name, at / 0.3048) for name, at in other_names(source, [each.position_m + far for each in source.stations])
    ]
    with pytest.raises(StationListError, match=r"may be in feet, .*: converted, by their shape .*by the same "):
        read_actual([write_csv(tmp_path / "feet.csv", feet)], source)


def test_names_of_other_stations_are_told_with_the_shift(source: PlanSource, tmp_path: Path) -> None:
    ids = [each.id for each in source.stations]
    places = [each.position_m + np.array([5e5, 0.0, 0.0]) for each in source.stations]
    rows = list(zip([*ids[1:], ids[0]], places, strict=True))  # a crew that numbers anew
    with pytest.raises(StationListError, match=r"by their shape .*give --match place$"):
        read_actual([write_csv(tmp_path / "anew.csv", rows)], source)


@pytest.mark.slow
def test_a_list_of_another_building_is_not_recognised(source: PlanSource, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rows = [(f"scan {k}", rng.uniform((5e5, 0, 1), (5e5 + 12, 10, 5))) for k in range(len(source.stations))]
    with pytest.raises(StationListError, match="expected them in scene coordinates or in the site's; give the site's"):
        read_actual([write_csv(tmp_path / "far.csv", rows)], source)


def test_a_list_at_the_plan_that_is_shifted_under_other_names_is_doubted(source: PlanSource, tmp_path: Path) -> None:
    rows = other_names(source, [each.position_m + np.array([30.0, -20.0, 0.0]) for each in source.stations])
    actual = read_actual([write_csv(tmp_path / "shifted.csv", rows)], source)
    (line,) = actual.doubts
    n = len(rows)
    assert re.match(
        r"the list has the plan's shape, but shifted by x \+(29\.9|30\.0)\d, y -(19\.9|20\.0)\d, z [+-]0\.0\d m: "
        r"without",
        line,
    )
    assert f"without that, {n} of {n} stations are within 0.5 m of planned ones, as listed 0 within 2 m" in line
    rows = other_names(source, [each.position_m for each in source.stations])
    assert read_actual([write_csv(tmp_path / "right.csv", rows)], source).doubts == ()


def test_a_shift_of_a_list_in_site_coordinates_is_told_in_them(source: PlanSource, tmp_path: Path) -> None:
    rows = other_names(source, [each.site_m + np.array([30.0, -20.0, 1.0]) for each in source.stations])
    actual = read_actual([write_csv(tmp_path / "site.csv", rows)], source)
    (line,) = actual.doubts
    found = re.search(r"but shifted by E (\S+), N (\S+), H (\S+) m: without that, ", line)
    assert found, line
    # The names are not the plan's, so that the least squares of the shape tell it, to the noise of the list.
    assert [float(value) for value in found.groups()] == pytest.approx([30.0, -20.0, 1.0], abs=0.1)


def test_swapped_columns_and_millimetres_are_guessed(source: PlanSource, tmp_path: Path) -> None:
    swapped = [(each.id, each.site_m[[1, 0, 2]]) for each in source.stations]
    with pytest.raises(StationListError, match="swapped"):
        read_actual([write_csv(tmp_path / "swapped.csv", swapped)], source, coordinates="site")
    millimetres = [(each.id, 1000.0 * each.site_m) for each in source.stations]
    with pytest.raises(StationListError, match="millimetres"):
        read_actual([write_csv(tmp_path / "mm.csv", millimetres)], source, coordinates="site")


def test_reduced_coordinates_are_a_shift_and_no_millimetres(source: PlanSource, tmp_path: Path) -> None:
    by = np.array([458_000.0, 5_438_000.0, 0.0])
    rows = [(each.id, each.site_m - by) for each in source.stations]
    with pytest.raises(StationListError, match=r"-458000\.00, -5438000\.00, 0\.00 m from the plan's site") as caught:
        read_actual([write_csv(tmp_path / "reduced.csv", rows)], source)
    assert "millimetres" not in str(caught.value)
    unnamed = [(f"scan {k}", at) for k, (_, at) in enumerate(rows)]
    with pytest.raises(StationListError) as caught:
        read_actual([write_csv(tmp_path / "unnamed.csv", unnamed)], source)
    assert "millimetres" not in str(caught.value)


def test_units_are_guessed_in_either_coordinates(source: PlanSource, tmp_path: Path) -> None:
    for scale, unit in ((1000.0, "millimetres"), (1.0 / 0.3048, "in feet"), (3937.0 / 1200.0, "US survey feet")):
        rows = [(each.id, scale * each.site_m) for each in source.stations]
        with pytest.raises(StationListError, match=unit):
            read_actual([write_csv(tmp_path / "scaled.csv", rows)], source)
    rows = [(f"scan {k}", 1000.0 * each.position_m + 200_000.0) for k, each in enumerate(source.stations)]
    with pytest.raises(
        StationListError,
        match=r"in millimetres, .*: converted, by their shape .* by the same 200\.00, 200\.00, 200\.00 m",
    ):
        read_actual([write_csv(tmp_path / "scaled.csv", rows)], source)


def test_swapped_easting_and_northing_are_named_whatever_the_list_is_nearer_to(
    source: PlanSource, tmp_path: Path
) -> None:
    rows = [(each.id, each.site_m[[1, 0, 2]]) for each in source.stations]
    with pytest.raises(StationListError, match="easting and northing may be swapped"):
        read_actual([write_csv(tmp_path / "swapped.csv", rows)], source)


@pytest.mark.parametrize("is_named", [True, False])
def test_swapped_columns_at_the_plan_are_doubted(source: PlanSource, tmp_path: Path, is_named: bool) -> None:
    names = [each.id if is_named else f"scan {k}" for k, each in enumerate(source.stations)]
    moved = np.array([0.1, -0.1, 0.0])
    rows = [(name, (each.position_m + moved)[[1, 0, 2]]) for name, each in zip(names, source.stations, strict=True)]
    actual = read_actual([write_csv(tmp_path / "swapped.csv", rows)], source, within_m=0.5)
    (line,) = actual.doubts
    n = len(rows)
    assert line.startswith(f"x and y of the list may be swapped: exchanged, {n} of {n} stations are within 0.5 m")
    rows = [(name, each.position_m + moved) for name, each in zip(names, source.stations, strict=True)]
    assert not read_actual([write_csv(tmp_path / "right.csv", rows)], source).doubts


def test_site_coordinates_of_an_unknown_site_are_refused(house_plan: Path, source: PlanSource, tmp_path: Path) -> None:
    nowhere = open_plan(house_plan, frame=FrameRequest(scene_coordinates=True))
    path = write_csv(tmp_path / "list.csv", [(each.id, each.site_m) for each in source.stations])
    with pytest.raises(StationListError, match="coordinate system of the site is not known"):
        read_actual([path], nowhere, coordinates="site")
    with pytest.raises(StationListError, match="is near the plan"):
        read_actual([path], nowhere)


def test_words_that_are_none_are_refused(source: PlanSource, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "list.csv", [("S001", source.stations[0].position_m)])
    wrong: tuple[dict[str, Any], ...] = ({"coordinates": "local"}, {"heights": "eye"}, {"columns": "PQ"})
    for told in wrong:
        with pytest.raises(RequirementError, match=rf"--{next(iter(told))}: got"):
            read_actual([path], source, **told)


@pytest.mark.parametrize("in_site", [False, True])
def test_decimal_commas_between_commas_are_refused_and_not_read_as_other_numbers(
    source: PlanSource, tmp_path: Path, in_site: bool
) -> None:
    rows = [
        f"{each.id},{','.join(f'{v:.2f}'.replace('.', ',') for v in (each.site_m if in_site else each.position_m))}"
        for each in source.stations
    ]
    path = tmp_path / "commas.csv"
    path.write_text("\n".join(["id,x,y,z", *rows]))
    with pytest.raises(StationListError, match=r"line 2: has 7 fields, the header 4.* decimal commas need semicolons"):
        read_actual([path], source)
    path.write_text("\n".join(["# by the crew", "", *rows]))
    with pytest.raises(StationListError, match=r"line 3: has 7 fields, --columns 4"):
        read_actual([path], source, columns="PENZ")
    path.write_text("\n".join(["id;x;y;z", *(row.replace(",", ";", 1).replace(",", ".") for row in rows)]))
    with pytest.raises(StationListError, match=r"line 2: has 2 fields, the header 4"):
        read_actual([path], source)


def test_heights_of_the_ground_with_their_own_instrument_height_are_the_sensor(
    source: PlanSource, tmp_path: Path
) -> None:
    at = source.stations[0].position_m
    (tmp_path / "list.csv").write_text(
        f"id,x,y,z,hi\nA,{at[0]},{at[1]},{at[2] - 1.7},1.7\nB,{at[0]},{at[1]},{at[2] - 1.7},\n"
    )
    a, b = read_actual([tmp_path / "list.csv"], source, heights="ground", coordinates="scene").stations
    np.testing.assert_allclose(a.position_m, at)
    assert (a.is_ground, a.instrument_height_m) == (False, 1.7)
    np.testing.assert_allclose(b.position_m, at - np.array([0.0, 0.0, 1.7]))
    assert b.is_ground
