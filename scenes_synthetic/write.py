"""Saving a synthetic scene: the extension names the format; the file is written beside its place and renamed.

Metres and z up in every format, except glTF, which is y up, and IFC, which is in millimetres. The bytes depend on the
scene only: no times, no random ids.
"""

from __future__ import annotations

import errno
import glob
import os
import tempfile
from pathlib import Path

from planner_core.errors import RequirementError
from planner_core.operating_system import is_disk_full
from scenes_synthetic.damage import as_in_files
from scenes_synthetic.glb import glb_bytes
from scenes_synthetic.mesh_files import obj_bytes, ply_bytes, stl_bytes
from scenes_synthetic.model import SyntheticScene

_BYTES = {".obj": obj_bytes, ".ply": ply_bytes, ".stl": stl_bytes, ".glb": glb_bytes}
_USD = (".usd", ".usda", ".usdc")
FORMATS = (".ifc", *_BYTES, *_USD)
"""Extensions that `write` knows."""


def write(synthetic: SyntheticScene, path: Path | str) -> Path:
    """Save a scene and return the path; an existing file is replaced, and stays whole if writing fails.

    Folders on the way are made. IFC keeps storeys, rooms, names, classes and openings; USD and GLB keep names and
    classes; OBJ keeps names; PLY and STL keep triangles only. Raises RequirementError for an extension that is not in
    `FORMATS`.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in FORMATS:
        raise RequirementError(
            f"{target.name}: scenes are not written as {suffix or 'files without an extension'}, "
            f"expected one of {', '.join(FORMATS)}; end the name with one of them."
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=suffix, dir=target.parent)
    os.close(handle)
    beside = Path(name)
    try:
        _fill(as_in_files(synthetic, suffix), beside, suffix)
        beside.chmod(0o644)  # mkstemp makes files that only their owner can read
        beside.replace(target)
    except Exception as error:
        if is_disk_full(beside):  # IfcOpenShell and usd-core name other reasons
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target)) from error
        raise
    finally:
        # Writers of libraries leave files of their own where they fail: all of them begin with our name.
        for left in target.parent.glob(f"{glob.escape(beside.name)}*"):
            left.unlink(missing_ok=True)
    return target


def _fill(synthetic: SyntheticScene, path: Path, suffix: str) -> None:
    # ifcopenshell and usd-core are heavy: loaded only where their format is required.
    if suffix == ".ifc":
        from scenes_synthetic.ifc import write_ifc

        write_ifc(synthetic, path)
    elif suffix in _USD:
        from scenes_synthetic.usd import write_usd

        write_usd(synthetic, path)
    else:
        path.write_bytes(_BYTES[suffix](synthetic))
