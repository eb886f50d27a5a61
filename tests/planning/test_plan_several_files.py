"""A plan on several files: the same as on the whole building, its folder opened again, and what names the files."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

import scenes_synthetic
from planner_core.errors import ExportError, PlanFolderError
from planner_core.model import Greedy, Plan, PlanSettings
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_settings import find_scene, load_options_of
from planner_core.plan_folder.plan_source import open_plan
from planner_core.planning.live.opening import open_live
from planner_core.planning.plan import make_plan
from planner_core.requirements.read import requirements_from
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import LoadOptions, load_scene

OPTIONS = LoadOptions(glass="stop", doors="open")


@dataclass(frozen=True)
class Split:
    files: tuple[Path, ...]
    plan: Plan
    folder: Path


def plan_of(*files: Path) -> Plan:
    requirements, _ = requirements_from({"coverage": "60 %"}, where="test", deliverable="none")
    settings = PlanSettings(
        scanner=replace(load_scanner("hdl-64e"), n_azimuths=360), requirements=requirements, method=Greedy(),
        grid_step_m=2.0, instrument_heights_m=(1.5,), max_patch_area_m2=0.5, refine=False,
    )  # fmt: skip
    return make_plan(load_scene(files, options=OPTIONS), settings)


@pytest.fixture(scope="module")
def split(tmp_path_factory: pytest.TempPathFactory) -> Split:
    whole = scenes_synthetic.build("doors-open")
    base = tmp_path_factory.mktemp("several")
    files = []
    for name, kinds in (("arch", ("IfcWall", "IfcDoor", "IfcWindow")), ("rest", None)):
        own = [part for part in whole.parts if (part.kind in ("IfcWall", "IfcDoor", "IfcWindow")) == bool(kinds)]
        scene = replace(whole, parts=tuple(own), rooms=whole.rooms if kinds else ())
        files.append(scenes_synthetic.write(scene, base / "models" / f"{name}.ifc"))
    plan = plan_of(*files)
    folder = base / "plans" / "first"
    write_plan_folder(plan, folder, pictures=False)
    return Split(tuple(files), plan, folder)


def moved(split: Split, to: Path) -> tuple[Path, list[Path]]:
    """A copy of plan folder and models, as they were to each other."""
    shutil.copytree(split.folder, to / "plans" / "first")
    shutil.copytree(split.files[0].parent, to / "models")
    return to / "plans" / "first", [to / "models" / file.name for file in split.files]


@pytest.mark.slow
def test_plan_on_parts_is_the_plan_on_the_whole(split: Split, tmp_path: Path) -> None:
    whole = plan_of(scenes_synthetic.write(scenes_synthetic.build("doors-open"), tmp_path / "whole.ifc"))
    assert len(whole.stations) == len(split.plan.stations)
    for one, other in zip(whole.stations, split.plan.stations, strict=True):
        assert one.position_m.tolist() == other.position_m.tolist()
    assert split.plan.coverage.covered_area_m2 == pytest.approx(whole.coverage.covered_area_m2, rel=1e-9)


@pytest.mark.slow
def test_plan_json_lists_files_and_finds_them_again(split: Split, tmp_path: Path) -> None:
    folder, files = moved(split, tmp_path)
    document = read_plan_json(folder)
    assert document["scene"]["file"] == "arch.ifc"
    assert [file["file"] for file in document["scene"]["other_files"]] == ["rest.ifc"]
    assert document["source"] == {"path": "../../models/arch.ifc", "other_paths": ["../../models/rest.ifc"]}
    assert load_options_of(document) == (OPTIONS, OPTIONS)
    assert [path.resolve() for path in find_scene(folder, document)] == files
    source = open_plan(folder)
    assert source.title == "arch.ifc and 1 more file"
    assert source.scene().n_triangles == split.plan.survey.scene.n_triangles


@pytest.mark.slow
def test_scene_files_are_told_one_by_one(split: Split, tmp_path: Path) -> None:
    folder, files = moved(split, tmp_path)
    aside = files[1].rename(tmp_path / "elsewhere.ifc")
    document = read_plan_json(folder)
    with pytest.raises(PlanFolderError, match=r"its scene rest\.ifc is not found .* give it with --scene"):
        find_scene(folder, document)
    assert not open_plan(folder).has_scene()
    assert [path.resolve() for path in find_scene(folder, document, scenes=aside)] == [files[0], aside]
    assert [path.resolve() for path in find_scene(folder, document, scenes=[aside, files[0]])] == [files[0], aside]
    with pytest.raises(PlanFolderError, match=r"plan.json: is not the file .* expected one of arch\.ifc, rest\.ifc;"):
        find_scene(folder, document, scenes=[aside, folder / "plan.json"])


def test_a_changed_second_file_is_refused(split: Split, tmp_path: Path) -> None:
    folder, files = moved(split, tmp_path)
    files[1].write_bytes(files[1].read_bytes() + b"\n")
    with pytest.raises(
        ExportError, match=r"rest\.ifc: has changed since .* was planned, expected rest\.ifc of SHA-256"
    ):
        open_plan(folder).scene_paths()


def test_live_editing_opens_all_files(split: Split, tmp_path: Path) -> None:
    folder, _ = moved(split, tmp_path)
    live = open_live(folder, with_ground=False)
    assert [source.path.name for source in live.survey.scene.sources] == ["arch.ifc", "rest.ifc"]
    assert live.survey.patches.n_patches == split.plan.survey.patches.n_patches


def test_what_is_unseen_is_told_with_its_file(split: Split) -> None:
    scene = split.plan.survey.scene
    rows = json.loads((split.folder / "plan.json").read_text(encoding="utf-8"))["unseen"]
    assert rows
    for row in rows:
        element = scene.elements[row["element"]]
        assert row["name"] == f"{element.name} ({('arch.ifc', 'rest.ifc')[element.file]})"
    (table,) = split.folder.rglob("unseen.csv")
    assert "(rest.ifc)" in table.read_text(encoding="utf-8")


def test_stage_has_a_prim_for_each_file_that_hides_it(split: Split) -> None:
    from pxr import Usd, UsdGeom

    (path,) = split.folder.glob("plan.usd*")
    stage = Usd.Stage.Open(str(path))
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh) and "/Building/" in str(prim.GetPath())]
    by_file = list(stage.GetPrimAtPath("/Plan/Building").GetChildren())
    assert [prim.GetName() for prim in by_file] == ["File_0_arch_ifc", "File_1_rest_ifc"]
    assert [prim.GetAttribute("tlsplan:file").Get() for prim in by_file] == ["arch.ifc", "rest.ifc"]
    stage.SetEditTarget(stage.GetSessionLayer())
    UsdGeom.Imageable(by_file[1]).MakeInvisible()
    shown = {mesh.GetAttribute("tlsplan:file").Get(): set() for mesh in meshes}
    for mesh in meshes:
        shown[mesh.GetAttribute("tlsplan:file").Get()].add(UsdGeom.Imageable(mesh).ComputeVisibility())
    assert shown == {"arch.ifc": {"inherited"}, "rest.ifc": {"invisible"}}
