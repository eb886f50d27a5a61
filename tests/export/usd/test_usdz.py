"""The stage as one USDZ, opened again by usd-core and by zipfile: whole, valid, the same bytes each time."""

from __future__ import annotations

import os
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdValidation
from shared_plans import SharedPlan

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import ExportError
from planner_core.export.write import export_plan


@pytest.fixture(scope="module")
def stage_folder(box_plan: SharedPlan) -> Path:
    """A plan folder with all of its stage; not to be written into."""
    return box_plan.folder


@pytest.fixture(scope="module")
def package(stage_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("package") / "plan.usdz"
    export_plan("usdz", stage_folder, path, frame=FrameRequest(crs="EPSG:25832", origin_m=(5e5, 5.3e6, 100.0)))
    return path


@pytest.fixture(scope="module")
def stage(package: Path) -> Iterator[Usd.Stage]:
    yield Usd.Stage.Open(str(package))


def test_package_has_the_prims_of_the_folder_and_the_same_figures(stage: Usd.Stage, stage_folder: Path) -> None:
    of_folder = Usd.Stage.Open(str(stage_folder / "plan.usda"))
    assert list(stage.GetCompositionErrors()) == []
    assert [prim.GetPath() for prim in stage.Traverse()] == [prim.GetPath() for prim in of_folder.Traverse()]
    for prim in of_folder.Traverse():
        for attribute in prim.GetAttributes():
            assert stage.GetAttributeAtPath(attribute.GetPath()).Get() == attribute.Get(), attribute.GetPath()
    assert any(prim.IsA(UsdGeom.Points) for prim in stage.TraverseAll())


def test_package_passes_all_validators_with_every_heat_map(stage: Usd.Stage) -> None:
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    variants = stage.GetDefaultPrim().GetVariantSet("heatmap")
    names = variants.GetVariantNames()
    assert sorted(names) == ["incidence", "plain", "range", "seen", "spacing", "times_seen"]
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for name in names:
            variants.SetVariantSelection(name)
            assert [f"{e.GetName()}: {e.GetMessage()}" for e in context.Validate(stage)] == [], name
        variants.ClearVariantSelection()


def test_clouds_and_review_pass_all_validators_by_themselves(stage_folder: Path) -> None:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    for path in (stage_folder / "review.usda", next(stage_folder.glob("stage/clouds/*.usdc"))):
        alone = Usd.Stage.Open(str(path))
        found = {e.GetName() for e in UsdValidation.ValidationContext(validators).Validate(alone)}
        # A review that nobody began defines no prim: it is no asset of its own, but a layer over the plan.
        assert found == ({"MissingDefaultPrim"} if path.name == "review.usda" else set())


def test_package_is_stored_in_64_byte_steps_with_the_root_first(package: Path) -> None:
    with zipfile.ZipFile(package) as archive:
        files = archive.infolist()
        assert archive.testzip() is None
    assert files[0].filename == "plan.usda"
    assert all(file.compress_type == zipfile.ZIP_STORED for file in files)
    content = package.read_bytes()
    for file in files:
        name, extra = (int.from_bytes(content[file.header_offset + at :][:2], "little") for at in (26, 28))
        assert (file.header_offset + 30 + name + extra) % 64 == 0


def test_package_names_its_coordinates(stage: Usd.Stage) -> None:
    told = stage.GetRootLayer().customLayerData["tlsplan"]
    assert told["crs"] == "EPSG:25832"
    assert np.fromstring(told["sceneToSite"], sep=" ").reshape(4, 4)[:3, 3].tolist() == [5e5, 5.3e6, 100.0]


def test_folder_without_clouds_loaded_opens_no_cloud(stage_folder: Path) -> None:
    bare = Usd.Stage.Open(str(stage_folder / "plan.usda"), Usd.Stage.LoadNone)
    assert not any("clouds" in layer.identifier for layer in bare.GetUsedLayers())


@pytest.mark.slow
def test_same_plan_gives_the_same_bytes(stage_folder: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(stage_folder, tmp_path / "plan"))
    for number, name in enumerate(("a.usdz", "b.usdz")):
        for path in folder.rglob("*.usd*"):
            os.utime(path, (1.7e9, 1.7e9 + 60 * number))
        export_plan("usdz", folder, tmp_path / name)
    assert (tmp_path / "a.usdz").read_bytes() == (tmp_path / "b.usdz").read_bytes()


def test_reviews_of_the_folder_are_in_the_package(stage_folder: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(stage_folder, tmp_path / "plan"))
    layer = Sdf.Layer.OpenAsAnonymous(str(folder / "review.usda"))
    prim = Sdf.CreatePrimInLayer(layer, "/Plan")
    Sdf.AttributeSpec(prim, "tlsplan:offsetX", Sdf.ValueTypeNames.Double).default = 12.5
    layer.Export(str(folder / "review.usda"))
    export_plan("usdz", folder, tmp_path / "reviewed.usdz")
    opened = Usd.Stage.Open(str(tmp_path / "reviewed.usdz"))
    assert opened.GetDefaultPrim().GetAttribute("tlsplan:offsetX").Get() == 12.5


def test_a_folder_that_lacks_a_layer_is_refused_in_one_line(stage_folder: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(stage_folder, tmp_path / "plan"))
    (folder / "stage" / "results.usdc").unlink()
    with pytest.raises(ExportError, match=r"results\.usdc: is not there.*plan again") as caught:
        export_plan("usdz", folder, tmp_path / "plan.usdz")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "plan.usdz").exists()
