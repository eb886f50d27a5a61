"""Plan folders that lack something, options that make no sense; and sheets under their formats' names."""

import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.errors import ExportError, RequirementError
from planner_core.export.options import Options
from planner_core.export.sheets.building import Building, read_building
from planner_core.export.sheets.pdf import write_pdf
from planner_core.export.write import export_plan
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import silent


def test_plan_folder_without_stage_has_sheets_without_walls(
    sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]
) -> None:
    (tmp_path / "bare").mkdir()
    (tmp_path / "bare" / "plan.json").write_bytes((sheet_folder / "plan.json").read_bytes())
    sheets = pdf_of(open_plan(tmp_path / "bare"))
    assert any("stage.usdc" in remark for remark in sheets.remarks)
    assert "walls and unseen surface are not drawn" in " ".join("\n".join(sheets.texts).split())
    assert len(sheets.spots(sheets.drawing("Level 1"))) == 4
    assert not sheets.pages_with("Point spacing")


@pytest.mark.parametrize("content", [b"no usd", b"#usda 1.0\n", b'#usda 1.0\ndef Xform "Plan" {}\n'])
def test_stage_that_is_none_is_refused(
    sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any], content: bytes
) -> None:
    (tmp_path / "bare" / "viewer").mkdir(parents=True)
    for name in ("plan.json", "viewer/patches.u8"):
        (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
    (tmp_path / "bare" / "viewer" / "stage.usdc").write_bytes(content)
    with pytest.raises(ExportError, match=r"stage\.usdc: .*expected .*plan again"):
        pdf_of(open_plan(tmp_path / "bare"))


@pytest.mark.parametrize("other", ["viewer/patches.u8", "viewer/reason.u8"])
def test_patches_of_another_plan_are_told(
    sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any], other: str
) -> None:
    (tmp_path / "bare" / "viewer").mkdir(parents=True)
    for name in ("plan.json", "viewer/stage.usdc", "viewer/patches.u8"):
        (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
    (tmp_path / "bare" / other).write_bytes(b"\1\2\3")
    sheets = pdf_of(open_plan(tmp_path / "bare"))
    assert any(f"{other} has 3 patches" in remark for remark in sheets.remarks)


def test_surface_without_a_requirement_is_known_by_its_reason(sheet_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(sheet_folder / "viewer", tmp_path / "viewer")
    whole = read_building(tmp_path)
    assert isinstance(whole, Building)
    assert whole.required.all()
    reasons = np.fromfile(tmp_path / "viewer" / "reason.u8", dtype=np.uint8)
    reasons[5:9] = 255
    reasons.tofile(tmp_path / "viewer" / "reason.u8")
    some = read_building(tmp_path)
    assert isinstance(some, Building)
    assert np.flatnonzero(~some.required).tolist() == [5, 6, 7, 8]
    (tmp_path / "viewer" / "reason.u8").unlink()
    older = read_building(tmp_path)
    assert isinstance(older, Building)
    assert older.required.all()


def test_layers_that_are_not_there_are_told(sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]) -> None:
    (tmp_path / "bare" / "viewer").mkdir(parents=True)
    for name in ("plan.json", "viewer/patches.u8", "viewer/stage.usdc", "viewer/layers.json"):
        (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
    with pytest.raises(ExportError, match=r"layers\.json: its layers can't be read \(FileNotFoundError"):
        pdf_of(open_plan(tmp_path / "bare"))


def test_plan_of_an_older_version_that_lacks_results_has_sheets(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def forget(document: dict[str, Any]) -> None:
        del document["requirements"]["results"]

    assert pdf_of(edited(forget)).n_pages > 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"paper": "A7"}, "paper: got 'A7', expected one of A4, A3"),
        ({"floors": ("F9",)}, "floor: got 'F9', expected one of F0 (Level 1)"),
        ({"cut_m": -1.0}, "cut: got -1 m, expected a height above the floor"),
        ({"cut_m": math.nan}, "cut: got nan m, expected a height above the floor"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    site_plan: PlanSource, pdf_of: Callable[..., Any], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(RequirementError, match=re.escape(message)):
        pdf_of(site_plan, **options)


@pytest.mark.parametrize("name", ["pdf", "html"])
def test_sheets_are_handed_over_by_name(sheet_folder: Path, tmp_path: Path, name: str) -> None:
    written = export_plan(name, sheet_folder, tmp_path / f"sheets.{name}", Options(paper="A4"))
    assert written.n_files == 1 and written.n_bytes > 10_000


def test_same_plan_gives_the_same_bytes(site_plan: PlanSource, site_sheets: Any, tmp_path: Path) -> None:
    write_pdf(site_plan, tmp_path / "again.pdf", Options(paper="A4"), silent)
    assert (tmp_path / "again.pdf").read_bytes() == site_sheets.path.read_bytes()


def stage_with(folder: Path, path: Path, change: str) -> None:
    """Put a plan's stage at `path`, as text, with the first prim that is changed by a statement about `prim`."""
    from pxr import Usd

    stage = Usd.Stage.Open(str(folder / "viewer" / "stage.usdc"))
    stage.Flatten().Export(str(path.with_suffix(".usda")))
    stage = Usd.Stage.Open(str(path.with_suffix(".usda")))
    prim = next(prim for prim in stage.Traverse() if prim.GetAttribute("primvars:tlsplan:triangle"))
    exec(change, {"prim": prim})
    stage.GetRootLayer().Export(str(path))


@pytest.mark.parametrize(
    "change",
    [
        "prim.GetAttribute('faceVertexIndices').Set([0, 1, 10**6])",
        "prim.GetAttribute('faceVertexIndices').Set([0, 1])",
        "depth = prim.GetAttribute('primvars:tlsplan:patchDepth'); depth.Set([200] * len(depth.Get()))",
        "prim.GetAttribute('primvars:tlsplan:triangle').Set([0])",
        "prim.RemoveProperty('tlsplan:element')",
        "prim.RemoveProperty('points')",
    ],
)
def test_stage_whose_figures_do_not_fit_is_refused(sheet_folder: Path, tmp_path: Path, change: str) -> None:
    shutil.copytree(sheet_folder / "viewer", tmp_path / "viewer")
    assert isinstance(read_building(tmp_path), Building)
    stage_with(sheet_folder, tmp_path / "viewer" / "stage.usdc", change)
    with pytest.raises(ExportError, match=r"stage\.usdc: is damaged \(.*expected the stage that a plan wrote"):
        read_building(tmp_path)


def test_stage_that_crashes_the_usd_library_is_refused(sheet_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(sheet_folder / "viewer", tmp_path / "viewer")
    from pxr import Sdf

    deep = "#usda 1.0\n" + 'def Xform "a"\n{\n' * 200_000 + "}\n" * 200_000
    (tmp_path / "viewer" / "deep.usda").write_text(deep)
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    layer.subLayerPaths.append("./deep.usda")
    layer.Export(str(tmp_path / "viewer" / "stage.usdc"))
    with pytest.raises(ExportError, match=r"the USD library crashed .* at its layers, expected a plan's stage"):
        read_building(tmp_path)
