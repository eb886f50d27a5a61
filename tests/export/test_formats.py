"""What all formats share: names, targets that are never replaced unasked, and files that appear whole or not at all."""

from __future__ import annotations

import csv
import hashlib
import importlib
import json
import re
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest
from tlsplan.commands.export import FORMAT_OPTIONS
from tlsplan.formats_reference import page

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import CrsNeededError, ExportError, OutputExistsError, PlanFolderError, RequirementError
from planner_core.export import formats
from planner_core.export.formats import ALL, FORMATS, Format, formats_named
from planner_core.export.options import Options
from planner_core.export.targets import RECORD
from planner_core.export.write import export_pack, export_plan
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import Progress, ProgressEvent

UTM = FrameRequest(crs="EPSG:25832", origin_m=(458_870.0, 5_438_260.0, 110.0))


def two_files(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    assert list(path.iterdir()) == []
    (path / "one.txt").write_text("one")
    (path / "deeper").mkdir()
    (path / "deeper" / "two.txt").write_text(str(options.seed))
    return ("of the folder",)


def half_a_file(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    target = path / "half" if path.is_dir() else path
    target.write_text("half")
    raise ExportError("no more")


def reads_a_layer(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    path.write_bytes((plan.folder / "viewer" / "reason.u8").read_bytes())
    return ()


@pytest.fixture
def own_formats(monkeypatch: pytest.MonkeyPatch) -> None:
    """Formats of a folder, of a scene, and of writers that fail."""
    own = (
        Format("folder", "a folder", "folder", two_files, options=("seed",)),
        Format("fails", "a file", "fails.txt", half_a_file),
        Format("fails-folder", "a folder", "fails", half_a_file),
        Format("layer", "a file", "layer.bin", reads_a_layer),
        Format("of-scene", "a folder", "of-scene", two_files, needs_scene=True, in_pack=False),
        Format("seedless", "a folder", "seedless", two_files, in_pack=False),
    )
    for each in own:
        monkeypatch.setitem(FORMATS, each.name, each)
    monkeypatch.setattr(formats, "_FORMATS", (FORMATS["csv"], own[0], own[4]))


# ------------------------------------------------------------------------------------------------ registry
@pytest.mark.parametrize("name", FORMATS)
def test_a_format_has_a_writer_and_says_what_it_is(name: str) -> None:
    each = FORMATS[name]
    assert each.name == name
    assert each.title
    assert each.verified_with
    assert each.example.startswith(f"tlsplan export plan/ --format {name} -o {each.file_name}")
    assert each.is_folder == (Path(each.file_name).suffix == "")
    module, function = (cell.cell_contents for cell in each.write.__closure__ or ())  # what `_lazy` was called with
    names = {str(module), str(function)}
    (module_name,) = (text for text in names if text.startswith("planner_core.export"))
    (function_name,) = names - {module_name}
    assert callable(getattr(importlib.import_module(module_name), function_name))


def test_the_page_of_formats_is_what_the_registry_says() -> None:
    folder = Path(__file__).parents[2] / "docs" / "formats" / "field-pack"
    assert (folder / "index.md").read_text(encoding="utf-8") == page(), (
        "run `python -m tlsplan.formats_reference docs/formats/field-pack/index.md`"
    )
    feet = (folder.parents[1] / "howto" / "feet.md").read_text(encoding="utf-8")
    for each in FORMATS.values():
        section = (folder / each.page).read_text(encoding="utf-8") if each.page else each.name
        assert re.search(rf"`?{each.name}`?", section), f"{each.page} has nothing on {each.name}"
        assert not each.feet or f"`{each.name}`" in feet, f"docs/howto/feet.md has no row of {each.name}"


def test_standard_names_are_told_apart() -> None:
    names = [each.file_name.lower() for each in FORMATS.values()]
    assert len(set(names)) == len(names)
    assert RECORD not in names


def test_options_of_formats_are_fields_and_options_of_the_command() -> None:
    known = {field.name for field in fields(Options)}
    assert set(FORMAT_OPTIONS) <= known
    for each in FORMATS.values():
        assert set(each.options) <= set(FORMAT_OPTIONS), each.name


def test_every_option_is_taken_by_some_format() -> None:
    taken = {option for each in FORMATS.values() for option in each.options}
    assert {field.name for field in fields(Options)} == taken


def test_all_means_every_format_of_a_pack_once() -> None:
    names = [each.name for each in formats_named(["csv", ALL, "csv"])]
    assert names[0] == "csv"
    assert sorted(names) == sorted(each.name for each in FORMATS.values() if each.in_pack or each.name == "csv")


def test_an_unknown_format_is_refused_with_those_there_are() -> None:
    with pytest.raises(RequirementError, match=r"'cvs'.*csv"):
        formats_named(["cvs"])


# ----------------------------------------------------------------------------------------------- one file
def test_a_file_appears_with_its_folders_and_nothing_beside_it(
    written_plan: Callable[..., Path], tmp_path: Path
) -> None:
    target = tmp_path / "to" / "the office" / "stations.csv"
    written = export_plan("csv", written_plan(stations=[STATION]), target, frame=UTM)
    assert [path.name for path in target.parent.iterdir()] == ["stations.csv"]
    assert (written.path, written.n_files, written.n_bytes) == (target, 1, target.stat().st_size)
    assert written.coordinates.startswith("EPSG:25832 ETRS89 / UTM zone 32N; vertical datum not given")
    assert any("a metre on the ground" in note for note in written.notes)
    row = next(csv.reader(target.read_text().splitlines()))
    assert row[:4] == ["S001", "458875.0000", "5438264.0000", "110.0000"]


STATION = {
    "id": "S001", "floor": "F0", "order": 1, "position": [5.0, 4.0, 1.6], "instrument_height_m": 1.6,
    "fixed": False, "own_area_m2": 1.0, "covered_area_m2": 2.0,
}  # fmt: skip


def test_a_file_that_is_there_is_replaced_when_asked_only(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    target, plan = tmp_path / "stations.csv", written_plan(stations=[STATION])
    target.write_text("mine")
    with pytest.raises(OutputExistsError, match="--overwrite"):
        export_plan("csv", plan, target)
    assert target.read_text() == "mine"
    export_plan("csv", plan, target, overwrite=True)
    assert target.read_text() != "mine"


def test_folders_and_links_are_no_files_to_replace(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    plan = written_plan(stations=[STATION])
    (tmp_path / "folder").mkdir()
    (tmp_path / "else.csv").write_text("else")
    (tmp_path / "link.csv").symlink_to(tmp_path / "else.csv")
    for name in ("folder", "link.csv"):
        with pytest.raises(OutputExistsError):
            export_plan("csv", plan, tmp_path / name, overwrite=True)
    assert (tmp_path / "else.csv").read_text() == "else"


@pytest.mark.usefixtures("own_formats")
def test_a_writer_that_fails_leaves_what_was_there(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    target, plan = tmp_path / "out" / "fails.txt", written_plan()
    target.parent.mkdir()
    target.write_text("before")
    with pytest.raises(ExportError, match="no more"):
        export_plan("fails", plan, target, overwrite=True)
    assert [(path.name, path.read_text()) for path in target.parent.iterdir()] == [("fails.txt", "before")]
    with pytest.raises(ExportError, match="no more"):
        export_plan("fails-folder", plan, tmp_path / "out" / "new")
    with pytest.raises(ExportError, match="no more"):
        export_pack(["fails", "fails-folder"], written_plan(stations=[STATION]), tmp_path / "out" / "pack")
    assert [path.name for path in target.parent.iterdir()] == ["fails.txt"]


def test_what_the_plan_is_made_of_is_never_replaced(box_folder: Path) -> None:
    plan = box_folder / "plan"
    (plan / "notes.csv").write_text("mine")
    (plan / "stations.csv").write_text("the plan's")
    for target in (box_folder / "box.ifc", plan / "plan.json", plan / "stations.csv", plan / ".." / "box.ifc"):
        before = target.read_bytes()
        with pytest.raises(OutputExistsError, match="what the plan is made of"):
            export_plan("csv", plan, target, overwrite=True)
        assert target.read_bytes() == before
    (box_folder / "box.ifc").rename(box_folder / "other.ifc")
    with pytest.raises(OutputExistsError, match="what the plan is made of"):
        export_plan("csv", plan, box_folder / "other.ifc", overwrite=True, scene=box_folder / "other.ifc")
    export_plan("csv", plan, plan / "notes.csv", overwrite=True)
    export_plan("csv", plan, plan / "new.csv")


def test_a_target_that_can_not_be_written_is_one_line(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ExportError, match="can't be written") as caught:
        export_plan("csv", written_plan(stations=[STATION]), tmp_path / "file" / "stations.csv")
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("own_formats")
def test_a_plan_folder_that_lacks_a_file_is_told_by_that_file(
    written_plan: Callable[..., Path], tmp_path: Path
) -> None:
    with pytest.raises(ExportError, match=r"reason\.u8: can't be read.*plan again"):
        export_plan("layer", written_plan(), tmp_path / "layer.bin")
    assert not (tmp_path / "layer.bin").exists()


def test_no_plan_is_told_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(PlanFolderError):
        export_plan("csv", tmp_path / "none", tmp_path / "deep" / "stations.csv")
    assert list(tmp_path.iterdir()) == []


# ----------------------------------------------------------------------------------------------- folders
@pytest.mark.usefixtures("own_formats")
def test_a_folder_says_what_it_is_of_and_in_which_coordinates(
    written_plan: Callable[..., Path], tmp_path: Path
) -> None:
    plan = written_plan()
    written = export_plan("folder", plan, tmp_path / "out", Options(seed=7), frame=UTM)
    assert (written.n_files, written.remarks) == (3, ("of the folder",))
    assert (tmp_path / "out" / "deeper" / "two.txt").read_text() == "7"
    record = json.loads((tmp_path / "out" / RECORD).read_text())
    assert record["schema"] == "tlsplan/pack/1"
    assert record["plan_sha256"] == hashlib.sha256((plan / "plan.json").read_bytes()).hexdigest()
    assert (record["crs"], record["source"]) == ("EPSG:25832", "given epsg")
    assert record["coordinates"] == written.coordinates
    assert record["scene_to_site"][0] == [1.0, 0.0, 0.0, 458_870.0]
    assert record["formats"] == {"folder": "folder"}
    assert record["files"] == {"deeper/two.txt": 1, "one.txt": 3}


@pytest.mark.usefixtures("own_formats")
def test_only_folders_of_ours_are_replaced_and_when_asked_only(
    written_plan: Callable[..., Path], tmp_path: Path
) -> None:
    plan, target = written_plan(), tmp_path / "out"
    target.mkdir()
    export_plan("folder", plan, target)  # an empty folder is free
    with pytest.raises(OutputExistsError, match="--overwrite"):
        export_plan("folder", plan, target)
    (target / "one.txt").write_text("changed")
    export_plan("folder", plan, target, overwrite=True)
    assert (target / "one.txt").read_text() == "one"
    (target / "deeper" / "notes.txt").write_text("mine")
    with pytest.raises(OutputExistsError, match=r"holds deeper/notes\.txt, which was not exported"):
        export_plan("folder", plan, target, overwrite=True)
    assert (target / "deeper" / "notes.txt").read_text() == "mine"
    (target / RECORD).write_text("{}")
    with pytest.raises(OutputExistsError, match="can't be read"):
        export_plan("folder", plan, target, overwrite=True)
    (target / RECORD).unlink()
    for overwrite in (False, True):
        with pytest.raises(OutputExistsError, match="were not exported"):
            export_plan("folder", plan, target, overwrite=overwrite)
    for other in ("file", "link"):
        (tmp_path / "file").write_text("") if other == "file" else (tmp_path / "link").symlink_to(target)
        with pytest.raises(OutputExistsError, match="is not a folder"):
            export_plan("folder", plan, tmp_path / other, overwrite=True)


@pytest.mark.usefixtures("own_formats")
def test_a_folder_of_the_last_release_is_replaced(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    plan, target = written_plan(), tmp_path / "out"
    export_plan("folder", plan, target)
    (target / RECORD).rename(target / "handover.json")
    (target / "one.txt").write_text("changed")
    export_plan("folder", plan, target, overwrite=True)
    assert (target / "one.txt").read_text() == "one"
    assert (target / RECORD).is_file()
    assert not (target / "handover.json").exists()


@pytest.mark.usefixtures("own_formats")
def test_a_pack_holds_each_format_under_its_standard_name(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    events: list[ProgressEvent] = []
    plan = written_plan(stations=[STATION])
    written = export_pack([ALL], plan, tmp_path / "pack", progress=events.append)
    found = sorted(path.relative_to(tmp_path / "pack").as_posix() for path in (tmp_path / "pack").rglob("*.*"))
    assert found == ["folder/deeper/two.txt", "folder/one.txt", RECORD, "stations.csv"]
    assert written.n_files == 4
    assert "folder: of the folder" in written.remarks
    assert [event.note for event in events] == ["csv", "folder"]
    record = json.loads((tmp_path / "pack" / RECORD).read_text())
    assert record["formats"] == {"csv": "stations.csv", "folder": "folder"}
    assert record["coordinates"] == "scene coordinates, no CRS"


@pytest.mark.usefixtures("own_formats")
def test_a_format_that_fails_takes_no_other_of_its_pack_along(
    written_plan: Callable[..., Path], tmp_path: Path
) -> None:
    plan, names = written_plan(stations=[STATION]), ["fails", "csv", "fails-folder", "layer", "folder"]
    written = export_pack(names, plan, tmp_path / "pack")
    assert written.failed[0] == "fails, fails-folder: no more"
    assert re.match(r"layer: .*reason\.u8: can't be read", written.failed[1])
    record = json.loads((tmp_path / "pack" / RECORD).read_text())
    assert record["formats"] == {"csv": "stations.csv", "folder": "folder"}
    assert sorted(path.name for path in (tmp_path / "pack").iterdir()) == ["folder", RECORD, "stations.csv"]


@pytest.mark.usefixtures("own_formats")
def test_what_needs_no_scene_is_refused_before_what_needs_one_is_written(
    box_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def not_reached(*_: object) -> tuple[str, ...]:
        raise AssertionError("written before the others")

    monkeypatch.setitem(FORMATS, "slow", Format("slow", "a folder", "slow", not_reached, needs_scene=True))
    with pytest.raises(CrsNeededError):
        export_pack(["slow", "kml"], box_folder / "plan", tmp_path / "pack", frame=FrameRequest(scene_coordinates=True))
    with pytest.raises(RequirementError, match="floor"):
        export_pack(["slow", "csv"], box_folder / "plan", tmp_path / "pack", Options(floors=("Attic",)))
    assert not (tmp_path / "pack").exists()


@pytest.mark.usefixtures("own_formats")
def test_what_several_formats_of_a_pack_remark_is_told_once(
    written_plan: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    again = Format("again", "a folder", "again", two_files)
    monkeypatch.setitem(FORMATS, "again", again)
    written = export_pack(["folder", "csv", "again"], written_plan(stations=[STATION]), tmp_path / "pack")
    assert [remark for remark in written.remarks if "of the folder" in remark] == ["folder, again: of the folder"]


def test_the_way_to_degrees_of_a_pack_is_told_once(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    written = export_pack(["geojson", "kml"], written_plan(stations=[STATION]), tmp_path / "pack", frame=UTM)
    (line,) = [remark for remark in written.remarks if "longitude and latitude by" in remark]
    assert line.startswith("geojson, kml: ")


def test_the_record_says_which_files_are_less_than_the_site(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    plan, names = written_plan(stations=[STATION]), ["csv", "gsi16", "landxml"]
    export_pack(names, plan, tmp_path / "less", Options(subtract=(458_000.0, 5_438_000.0, 0.0)), frame=UTM)
    record = json.loads((tmp_path / "less" / RECORD).read_text())
    less_m = [458_000.0, 5_438_000.0, 0.0]
    assert record["subtracted_m"] == {"stations.csv": less_m, "stations-16.gsi": less_m}
    assert set(record["subtracted_m"]) < set(record["files"])
    row = next(csv.reader((tmp_path / "less" / "stations.csv").read_text().splitlines()))
    assert row[1:3] == ["875.0000", "264.0000"]
    export_pack(names, plan, tmp_path / "whole", frame=UTM)
    assert json.loads((tmp_path / "whole" / RECORD).read_text())["subtracted_m"] == {}


@pytest.mark.usefixtures("own_formats")
def test_a_missing_scene_is_told_before_anything_is_written(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    for ask in (
        lambda: export_plan("of-scene", written_plan(), tmp_path / "a" / "out"),
        lambda: export_pack(["csv", "of-scene"], written_plan(), tmp_path / "a" / "out"),
    ):
        with pytest.raises(ExportError, match="--scene"):
            ask()
    assert not (tmp_path / "a").exists()


@pytest.fixture
def pack_of_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pack of stations and of something made from the scene."""
    of_scene = Format("of-scene", "a folder", "of-scene", two_files, needs_scene=True)
    monkeypatch.setitem(FORMATS, "of-scene", of_scene)
    monkeypatch.setattr(formats, "_FORMATS", (FORMATS["csv"], of_scene))


@pytest.mark.usefixtures("pack_of_scene")
def test_a_pack_goes_without_what_needs_a_scene_that_is_missing(box_folder: Path, tmp_path: Path) -> None:
    export_pack([ALL], box_folder / "plan", tmp_path / "whole")
    assert (tmp_path / "whole" / "of-scene").is_dir()
    (box_folder / "box.ifc").rename(box_folder / "moved.ifc")
    written = export_pack([ALL], box_folder / "plan", tmp_path / "pack")
    assert sorted(path.name for path in (tmp_path / "pack").iterdir()) == [RECORD, "stations.csv"]
    (remark,) = [remark for remark in written.remarks if "left out" in remark]
    assert remark.startswith("left out: of-scene: ")
    assert "box.ifc is not found" in remark
    assert "--scene" in remark
    assert json.loads((tmp_path / "pack" / RECORD).read_text())["formats"] == {"csv": "stations.csv"}
    export_pack([ALL], box_folder / "plan", tmp_path / "told", scene=box_folder / "moved.ifc")
    assert (tmp_path / "told" / "of-scene").is_dir()


@pytest.mark.usefixtures("pack_of_scene")
def test_a_scene_that_is_asked_for_by_name_is_not_left_out(written_plan: Callable[..., Path], tmp_path: Path) -> None:
    plan = written_plan(stations=[STATION])
    with pytest.raises(ExportError, match="--scene"):
        export_pack([ALL, "of-scene"], plan, tmp_path / "pack")
    with pytest.raises(ExportError, match=r"none\.ifc: no such file.*--scene"):
        export_pack([ALL], plan, tmp_path / "pack", scene=tmp_path / "none.ifc")
    assert not (tmp_path / "pack").exists()


@pytest.mark.slow
def test_the_same_plan_gives_the_same_bytes(box_folder: Path, tmp_path: Path) -> None:
    names = [each.name for each in FORMATS.values() if each.in_pack and not each.needs_scene]
    packs = []
    for name in ("one", "two"):
        export_pack(names, box_folder / "plan", tmp_path / name)
        folder = tmp_path / name
        packs.append({p.relative_to(folder): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()})
    assert list(packs[0]) == list(packs[1])
    assert [str(path) for path in packs[0] if packs[0][path] != packs[1][path]] == []


def test_an_opened_plan_does_for_several_formats(box_folder: Path, tmp_path: Path) -> None:
    plan = open_plan(box_folder / "plan", frame=FrameRequest(scene_coordinates=True))
    assert export_plan("csv", plan, tmp_path / "a.csv").coordinates == "scene coordinates, no CRS"
    assert export_plan("csv", plan, tmp_path / "b.csv").n_bytes == (tmp_path / "a.csv").stat().st_size


@pytest.mark.usefixtures("own_formats")
def test_what_is_meant_for_one_format_of_a_pack_does_not_reach_another(box_folder: Path, tmp_path: Path) -> None:
    export_pack(["folder", "seedless"], box_folder / "plan", tmp_path / "pack", Options(seed=7))
    seeds = [(tmp_path / "pack" / name / "deeper" / "two.txt").read_text() for name in ("folder", "seedless")]
    assert seeds == ["7", "0"]
