"""Writing named solids to PLY or OBJ as they come, in memory that does not grow with their number.

Metres, z up. PLY is binary with double coordinates; its faces wait in a second file until all vertices are written. OBJ
names each solid.
"""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

import numpy as np

from planner_core.errors import RequirementError
from scenes_synthetic.solids import Solid

STREAM_FORMATS = (".ply", ".obj")
_HEADER_BYTES = 512


def stream_file(path: Path | str, solids: Iterable[tuple[str, Solid]], name: str) -> Path:
    """Write (name, solid) pairs to `path`, return it; an existing file is replaced, and stays whole if writing fails.

    Raises RequirementError for an extension that is not in `STREAM_FORMATS`.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in STREAM_FORMATS:
        raise RequirementError(
            f"{target.name}: {name} is not written as {suffix or 'a file without an extension'}, "
            f"expected one of {', '.join(STREAM_FORMATS)}; end the name with one of them."
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(prefix=f".{target.stem}-", suffix=suffix, dir=target.parent, delete=False) as file:
        beside = Path(file.name)
        try:
            if suffix == ".ply":
                with tempfile.TemporaryFile(dir=target.parent) as faces:
                    _stream_ply(file, faces, solids, name)  # type: ignore[arg-type]
            else:
                _stream_obj(file, solids, name)  # type: ignore[arg-type]
            file.close()
            beside.chmod(0o644)  # temporary files can be read by their owner only
            beside.replace(target)
        except BaseException:
            with contextlib.suppress(FileNotFoundError):
                beside.unlink()
            raise
    return target


def _stream_ply(file: BinaryIO, waiting: BinaryIO, solids: Iterable[tuple[str, Solid]], name: str) -> None:
    file.write(bytes(_HEADER_BYTES))
    n_vertices = n_faces = 0
    for _, solid in solids:
        file.write(solid.vertices_m.astype("<f8").tobytes())
        faces = np.empty(len(solid.triangles), dtype=[("count", "u1"), ("vertex", "<i4", (3,))])
        faces["count"] = 3
        faces["vertex"] = solid.triangles + n_vertices
        waiting.write(faces.tobytes())
        n_vertices += len(solid.vertices_m)
        n_faces += len(solid.triangles)
    waiting.seek(0)
    shutil.copyfileobj(waiting, file, 1 << 22)
    file.seek(0)
    file.write(_ply_header(name, n_vertices, n_faces))


def _ply_header(name: str, n_vertices: int, n_faces: int) -> bytes:
    """Header of `_HEADER_BYTES` whatever the counts: spaces in the comment make up for missing digits."""
    begin = f"ply\nformat binary_little_endian 1.0\ncomment tlsplan synthetic scene {name}: metres, z up"
    end = (
        f"\nelement vertex {n_vertices}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return (begin.ljust(_HEADER_BYTES - len(end)) + end).encode("ascii")


def _stream_obj(file: BinaryIO, solids: Iterable[tuple[str, Solid]], name: str) -> None:
    file.write(f"# tlsplan synthetic scene {name}: metres, z up\n".encode("ascii"))
    first = 1
    for label, solid in solids:
        n_vertices, n_faces = len(solid.vertices_m), len(solid.triangles)
        # One format for a whole solid: a third of the time of a line at a time.
        vertices = "v %.6f %.6f %.6f\n" * n_vertices % tuple(solid.vertices_m.ravel().tolist())
        faces = "f %d %d %d\n" * n_faces % tuple((solid.triangles + first).ravel().tolist())
        file.write(f"o {label}\n{vertices}{faces}".encode("ascii"))
        first += n_vertices
