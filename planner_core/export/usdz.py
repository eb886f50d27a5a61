"""The plan's USD stage in one file: plan.usda and all that it is made of, clouds and review too, as USDZ.

PlanSource -> usdz. Layers go in as they are; the root layer has the site's coordinate system besides.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from planner_core.errors import ExportError
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.sdf_authoring import Sdf, Tf, put_site
from planner_core.progress import Progress, ProgressEvent

ROOT = "plan.usda"
#: When all of a package was made: a noon in local time, so that it reads the same in every time zone.
_TIME_S = time.mktime((1980, 1, 2, 12, 0, 0, 0, 0, 0))


def write_usdz(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the package; nothing is composed, so that variants, payloads and the review layer stay what they are.

    Raises
    ------
    ExportError
        The plan folder lacks a layer of its stage, or one can't be read.
    """
    names = _layer_names(plan)
    with tempfile.TemporaryDirectory() as scratch:
        layer = Path(scratch) / "layer"
        # USD takes any file of this name for a package only by its suffix, and the staged one has another.
        package = Path(scratch) / "plan.usdz"
        try:
            with Sdf.ZipFileWriter.CreateNew(str(package)) as writer:
                for number, name in enumerate((ROOT, *names)):
                    progress(ProgressEvent("usdz", number, len(names) + 1, name))
                    layer.write_bytes(_root_text(plan).encode() if name == ROOT else (plan.folder / name).read_bytes())
                    os.utime(layer, (_TIME_S, _TIME_S))  # which goes into the package
                    writer.AddFile(str(layer), name)
        except Tf.ErrorException as error:
            raise ExportError(f"usdz: can't be written ({_last_line(error)}); check the free space") from error
        path.write_bytes(package.read_bytes())
    return ()


def _root_text(plan: PlanSource) -> str:
    """The text of plan.usda, with the site's coordinates."""
    layer = _opened(plan.folder / ROOT)
    put_site(layer, plan.frame)
    return str(layer.ExportToString())


def _layer_names(plan: PlanSource) -> tuple[str, ...]:
    """Files that plan.usda is made of, below the folder: sublayers, and the payloads of the stations' clouds."""
    root = _opened(plan.folder / ROOT)  # held: its lists die with it
    sublayers = [name.removeprefix("./") for name in root.subLayerPaths]
    clouds = sorted(path.relative_to(plan.folder).as_posix() for path in plan.folder.glob("stage/clouds/*.usdc"))
    names = (*sublayers, *clouds)
    missing = next((name for name in names if not (plan.folder / name).is_file()), None)
    if missing is not None:
        raise ExportError(f"{plan.folder / missing}: is not there, expected a layer of the plan's stage; plan again")
    return names


def _opened(path: Path) -> Sdf.Layer:
    if not path.is_file():
        raise ExportError(f"{path}: is not there, expected the plan's stage; plan again")
    try:
        return Sdf.Layer.OpenAsAnonymous(str(path))
    except Tf.ErrorException as error:
        raise ExportError(f"{path}: can't be read as USD ({_last_line(error)}); plan again") from error


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1].strip()
