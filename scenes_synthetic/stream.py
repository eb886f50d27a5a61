"""Writing parts to PLY, OBJ, GLB or USDZ as they come, in memory that does not grow with their triangles.

Metres, z up (GLB: y up). PLY is binary with double coordinates and no names; OBJ names each part; GLB and USDZ, in 32
bit, name each part and its class, under a node or prim for each group of parts. What a format has at its end, or sizes
that it has at its beginning, wait in temporary files beside the target: on disk, a file is there twice for a while.
"""

from __future__ import annotations

import itertools
import shutil
import struct
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import replace
from operator import itemgetter
from pathlib import Path

import numpy as np

from planner_core.errors import RequirementError
from planner_core.plan_folder.atomic import scratch_folder, staged_file
from scenes_synthetic.glb import GlbWriter
from scenes_synthetic.model import Part

Parts = Iterable[tuple[str, Part]]
"""Groups (a building, the park) and their parts; the parts of a group follow each other."""

_HEADER_BYTES = 512
_MOST_BYTES = {".glb": 2**32 - 2**20, ".usdz": 2**31 - 2**20}
"""What GLB's sizes of 32 bits hold, and what `zipfile` puts into a ZIP without 64-bit extensions, which USDZ is: less a
mebibyte, for a GLB's head and a ZIP's directory."""
_LEAST_BYTES = {".glb": 18, ".usdz": 6}
"""Of a triangle of a closed surface: half a vertex in 32 bit, and its three indices, which USD squeezes."""
_USDZ_ALIGNMENT, _ZIP_ENTRY_BYTES, _ZIP_PADDING_ID = 64, 30, 0x1986


def stream_file(path: Path | str, parts: Parts, name: str, *, n_triangles: int) -> Path:
    """Write parts to `path`, return it; an existing file is replaced, and stays whole if writing fails.

    n_triangles : about how many there will be, to refuse at once what a format can't hold.

    Raises RequirementError for an extension that is not in `STREAM_FORMATS`, and for more than it can hold.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in _WRITERS:
        raise RequirementError(
            f"{target.name}: {name} is not written as {suffix or 'a file without an extension'}, "
            f"expected one of {', '.join(STREAM_FORMATS)}; end the name with one of them."
        )
    _refuse_too_large(suffix, n_triangles * _LEAST_BYTES.get(suffix, 0))
    target.parent.mkdir(parents=True, exist_ok=True)
    with staged_file(target) as beside, scratch_folder(target) as waiting:
        _WRITERS[suffix](beside, waiting, parts, name)
    return target


def _refuse_too_large(suffix: str, n_bytes: int) -> None:
    most = _MOST_BYTES.get(suffix)
    if most is not None and n_bytes > most:
        raise RequirementError(
            f"{suffix}: got {n_bytes / 2**30:.1f} GiB or more, expected at most the {round(most / 2**30)} GiB that "
            "such a file can hold; ask for fewer triangles, or for .ply or .obj."
        )


def _write_ply(path: Path, folder: Path, parts: Parts, name: str) -> None:
    """Write the vertices, while the faces wait in a second file, and the header once all are counted."""
    n_vertices = n_faces = 0
    with path.open("wb") as file, (folder / "faces").open("w+b") as waiting:
        file.write(bytes(_HEADER_BYTES))
        for _, part in parts:
            solid = part.solid
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


def _write_obj(path: Path, folder: Path, parts: Parts, name: str) -> None:
    del folder  # nothing has to wait
    first = 1
    with path.open("wb") as file:
        file.write(f"# tlsplan synthetic scene {name}: metres, z up\n".encode("ascii"))
        for group, part in parts:
            solid = part.solid
            n_vertices, n_faces = len(solid.vertices_m), len(solid.triangles)
            # One format for a whole solid: a third of the time of a line at a time.
            vertices = "v %.6f %.6f %.6f\n" * n_vertices % tuple(solid.vertices_m.ravel().tolist())
            faces = "f %d %d %d\n" * n_faces % tuple((solid.triangles + first).ravel().tolist())
            file.write(f"o {group}: {part.name}\n{vertices}{faces}".encode("ascii"))
            first += n_vertices


def _write_glb(path: Path, folder: Path, parts: Parts, name: str) -> None:
    """Write the arrays to a second file, which follows the description once that is complete."""
    roots = []
    with (folder / "binary").open("w+b") as binary:
        writer = GlbWriter(binary)
        for group, of_group in itertools.groupby(parts, key=itemgetter(0)):
            nodes = []
            for _, part in of_group:
                nodes.append(writer.add_part(replace(part, name=f"{group}: {part.name}")))
                _refuse_too_large(".glb", writer.n_bytes)
            roots.append(writer.add_group(group, nodes))
        with path.open("wb") as file:
            writer.finish(file, name, roots)


def _write_usdz(path: Path, folder: Path, parts: Parts, name: str) -> None:
    """Write a layer a group, and a root layer that refers to them all, and pack them: one file, as USDZ is."""
    # usd-core is heavy: loaded only where its format is required.
    from scenes_synthetic.usd import write_group, write_root

    layers = {}
    for number, (group, of_group) in enumerate(itertools.groupby(parts, key=itemgetter(0)), start=1):
        layers[group] = f"group_{number}.usdc"
        write_group(group, (part for _, part in of_group), folder / layers[group])
    write_root(name, layers, folder / "root.usda")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=False) as package:
        for layer in ("root.usda", *layers.values()):
            _refuse_too_large(".usdz", package.start_dir + (folder / layer).stat().st_size)
            _pack(package, folder / layer)


def _pack(package: zipfile.ZipFile, layer: Path) -> None:
    """Store a layer without a time, its bytes aligned as USDZ wants them: an extra field of the entry pads."""
    entry = zipfile.ZipInfo(layer.name)  # of 1980, as all entries without a time
    unpadded = package.start_dir + _ZIP_ENTRY_BYTES + len(layer.name) + 4
    entry.extra = struct.pack("<HH", _ZIP_PADDING_ID, -unpadded % _USDZ_ALIGNMENT)
    entry.extra += bytes(-unpadded % _USDZ_ALIGNMENT)
    entry.file_size = layer.stat().st_size
    with layer.open("rb") as content, package.open(entry, "w") as file:
        shutil.copyfileobj(content, file, 1 << 22)
    layer.unlink()


_WRITERS: dict[str, Callable[[Path, Path, Parts, str], None]] = {
    ".ply": _write_ply,
    ".obj": _write_obj,
    ".glb": _write_glb,
    ".usdz": _write_usdz,
}
STREAM_FORMATS = tuple(_WRITERS)
"""Extensions that `stream_file` knows."""
