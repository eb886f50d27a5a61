"""Plans from office-like polygons of a published art-gallery set, read where the user has them.

The files are those of KaiKobbe/dispersive_agp_solver (evaluation/office_like_instances; MIT, copyright 2023 Dominik
Krupke): GraphML, packed by xz, rings of a polygon with or without holes as edges between corners. None of it is kept
here: instances are made from them on demand, and certificates name the digest of what has to come out.
"""

from __future__ import annotations

import lzma
import xml.etree.ElementTree as ET
from pathlib import Path

from planner_core.errors import SceneError

from .plans import Plan, Wall

_SPACE = "{http://graphml.graphdrawing.org/xmlns}"
#: Far more than any file of the set.
_MOST_BYTES = 16 << 20


def plan_of(path: Path, *, unit_cm: int) -> Plan:
    """Walls of a file; its unit becomes so many centimetres.

    Raises
    ------
    SceneError
        Not a file of the set.
    """
    try:
        raw = lzma.LZMADecompressor().decompress(path.read_bytes(), _MOST_BYTES)
        if b"<!ENTITY" in raw or b"<!DOCTYPE" in raw:
            raise SceneError(f"{path}: got a document type, expected plain GraphML; get the file again")
        graph = ET.fromstring(raw)
        corners = {}
        for node in graph.iter(f"{_SPACE}node"):
            values = {data.get("key"): float(data.text or "") for data in node.iter(f"{_SPACE}data")}
            corners[node.get("id")] = tuple(round(values[key] * unit_cm) for key in ("d0", "d1"))
        ends = [(corners[e.get("source")], corners[e.get("target")]) for e in graph.iter(f"{_SPACE}edge")]
    except (lzma.LZMAError, ET.ParseError, KeyError, ValueError) as error:
        raise SceneError(f"{path}: got {error!r}, expected GraphML of a polygon packed by xz; get it again") from None
    if len(ends) < 3 or len(ends) != len(corners):
        raise SceneError(f"{path}: got {len(ends)} edges of {len(corners)} corners, expected rings; get the file again")
    low = [min(corner[axis] for corner in corners.values()) for axis in (0, 1)]
    walls: list[Wall] = sorted((a[0] - low[0], a[1] - low[1], b[0] - low[0], b[1] - low[1]) for a, b in ends)
    return Plan(tuple(walls))
