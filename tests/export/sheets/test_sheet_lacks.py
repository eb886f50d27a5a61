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
from planner_core.export.sheets.building import Building, read_building, read_meshes
from planner_core.export.sheets.sheet_set import write_pdf
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import silent


@pytest.mark.slow
def test_plan_folder_without_stage_has_sheets_without_walls(
    bare: Callable[..., Path], pdf_of: Callable[..., Any]
) -> None:
    sheets = pdf_of(open_plan(bare()))
    assert any("stage.usdc" in remark for remark in sheets.remarks)
    assert "walls and unseen surface are not drawn" in " ".join("\n".join(sheets.texts).split())
    assert len(sheets.spots(sheets.drawing("Level 1"))) == 4
    assert not sheets.pages_with("Point spacing")


@pytest.fixture
def bare(sheet_folder: Path, tmp_path: Path) -> Callable[..., Path]:
    """Call with names of files; returns a plan folder that holds plan.json and these."""

    def make(*names: str) -> Path:
        (tmp_path / "bare" / "viewer").mkdir(parents=True)
        for name in ("plan.json", *names):
            (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
        return tmp_path / "bare"

    return make


def test_stage_that_is_none_is_refused(bare: Callable[..., Path], pdf_of: Callable[..., Any]) -> None:
    stage = bare("viewer/patches.u8") / "viewer" / "stage.usdc"
    for content in (b"#usda 1.0\n", b'#usda 1.0\ndef Xform "Plan" {}\n', b"no usd"):
        stage.write_bytes(content)
        with pytest.raises(ExportError, match=r"stage\.usdc: .*expected .*plan again"):
            read_meshes(str(stage))
    with pytest.raises(ExportError, match=r"stage\.usdc: .*expected .*plan again"):
        pdf_of(open_plan(stage.parents[1]))


@pytest.mark.parametrize("other", ["viewer/patches.u8", "viewer/reason.u8"])
def test_patches_of_another_plan_are_told(bare: Callable[..., Path], other: str) -> None:
    folder = bare("viewer/stage.usdc", "viewer/patches.u8")
    (folder / other).write_bytes(b"\1\2\3")
    assert str(read_building(folder)).startswith(f"{other} has 3 patches")


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


def test_layers_that_are_not_there_are_told(bare: Callable[..., Path], pdf_of: Callable[..., Any]) -> None:
    folder = bare("viewer/patches.u8", "viewer/stage.usdc", "viewer/layers.json")
    with pytest.raises(ExportError, match=r"layers\.json: its layers can't be read \(FileNotFoundError"):
        pdf_of(open_plan(folder))


@pytest.mark.slow
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


@pytest.mark.slow
def test_same_plan_gives_the_same_bytes(site_plan: PlanSource, site_sheets: Any, tmp_path: Path) -> None:
    write_pdf(site_plan, tmp_path / "again.pdf", Options(paper="A4"), silent)
    assert (tmp_path / "again.pdf").read_bytes() == site_sheets.path.read_bytes()


@pytest.fixture(scope="module")
def stage_text(sheet_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan's stage as text."""
    from pxr import Usd

    path = tmp_path_factory.mktemp("stage") / "stage.usda"
    Usd.Stage.Open(str(sheet_folder / "viewer" / "stage.usdc")).Flatten().Export(str(path))
    assert read_meshes(str(path))[0]
    return path


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
def test_stage_whose_figures_do_not_fit_is_refused(stage_text: Path, tmp_path: Path, change: str) -> None:
    from pxr import Sdf, Usd

    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(stage_text)))
    prim = next(prim for prim in stage.Traverse() if prim.GetAttribute("primvars:tlsplan:triangle"))
    exec(change, {"prim": prim})
    stage.GetRootLayer().Export(str(tmp_path / "stage.usdc"))
    with pytest.raises(ExportError, match=r"stage\.usdc: is damaged \(.*expected the stage that a plan wrote"):
        read_meshes(str(tmp_path / "stage.usdc"))


def test_stage_that_crashes_the_usd_library_is_refused(bare: Callable[..., Path]) -> None:
    from pxr import Sdf

    folder = bare("viewer/patches.u8")
    deep = "#usda 1.0\n" + 'def Xform "a"\n{\n' * 200_000 + "}\n" * 200_000
    (folder / "viewer" / "deep.usda").write_text(deep)
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    layer.subLayerPaths.append("./deep.usda")
    layer.Export(str(folder / "viewer" / "stage.usdc"))
    with pytest.raises(ExportError, match=r"the USD library crashed .* at its layers, expected a plan's stage"):
        read_building(folder)
