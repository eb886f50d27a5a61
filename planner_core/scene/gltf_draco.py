"""Draco-compressed primitives of glTF: positions and triangles out of a buffer view, by DracoPy (Apache-2.0).

Source: Khronos Group, glTF extension KHR_draco_mesh_compression.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner_core.errors import MissingPackageError, SceneError, reason_of
from planner_core.model import FloatArray, Int64Array
from planner_core.scene.raw import exact

DRACO = "KHR_draco_mesh_compression"
_BLOCK_BYTES = 2**24


def names_draco(path: Path) -> bool:
    """A file names the extension, and so may hold what DracoPy, a native library, has to read."""
    with path.open("rb") as file:
        before = b""
        while block := file.read(_BLOCK_BYTES):
            if DRACO.encode() in before + block:
                return True
            before = block[-len(DRACO) :]
    return False


def decoded(file_name: str, contents: bytes, position: int) -> tuple[FloatArray, Int64Array]:
    """(V, 3) float64 and (T, 3) of a compressed primitive, whatever its mode.

    Parameters
    ----------
    contents : the bytes of the primitive's buffer view.
    position : Draco's number of the attribute that is POSITION.

    Raises
    ------
    SceneError
        It is damaged, or has no such attribute.
    MissingPackageError
        DracoPy is not installed.
    """
    try:
        import DracoPy
    except ImportError as error:
        raise MissingPackageError(
            f"{file_name}: reading Draco-compressed glTF needs the package dracopy, which is missing; "
            "run pip install dracopy."
        ) from error
    try:
        mesh = DracoPy.decode(contents)
    except (DracoPy.FileTypeException, DracoPy.EncodingFailedException, ValueError, RuntimeError, MemoryError) as error:
        reason = reason_of(error)
        raise SceneError(f"{file_name}: its Draco compression can't be undone ({reason}); export it again.") from error
    positions = next((a["data"] for a in getattr(mesh, "attributes", ()) if a["unique_id"] == position), None)
    triangles = getattr(mesh, "faces", None)
    if positions is None or triangles is None or positions.ndim != 2 or positions.shape[1] != 3:
        raise SceneError(f"{file_name}: its Draco compression holds no triangles with positions; export it again.")
    return exact(np.asarray(positions)), np.asarray(triangles).reshape(-1, 3).astype(np.int64)
