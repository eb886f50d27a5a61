"""Pictures of the synthetic scenes for the documentation: `python -m scenes_synthetic.pictures docs/images`.

Every part is cut by a horizontal plane and closed again, so that walls show their thickness.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyvista as pv
from PIL import Image

import scenes_synthetic
from scenes_synthetic.model import Part, SyntheticScene
from scenes_synthetic.solids import Solid, join

_COLOURS = {
    "IfcWall": "#e9e6df",
    "IfcSlab": "#cbb994",
    "IfcRoof": "#8d8f93",
    "IfcStair": "#b98b5a",
    "IfcRailing": "#5d6470",
    "IfcDoor": "#9c6a46",
    "IfcWindow": "#86b6d8",
    "IfcFurniture": "#d9b48a",
    "IfcSanitaryTerminal": "#f7f9fb",
    "IfcElectricAppliance": "#c3c9d1",
    "IfcColumn": "#d5d2ca",
    "IfcPlate": "#7fc4c9",
    "IfcDuctSegment": "#b9c4cc",
    "IfcPipeSegment": "#c0715a",
    "IfcLightFixture": "#fbf3c4",
    "IfcSpaceHeater": "#f3f1ea",
    "IfcTank": "#8fa6b5",
    "IfcBoiler": "#c98a5c",
    "IfcPump": "#5f86a6",
    "IfcUnitaryEquipment": "#a9b4ba",
}
_OTHER_COLOUR = "#c9c9c9"
_BY_NAME = (
    ("chair", "#4d6f8c"),
    ("shelf", "#a9744f"),
    ("plant", "#6f9a5b"),
    ("computer", "#3f444b"),
    ("board", "#4b6b57"),
    ("bicycle", "#b5473f"),
    ("cartons", "#c8a26a"),
    ("barrel", "#3f6f99"),
    ("mat", "#7089a8"),
)
"""Colours of furniture in the large scenes, by the word its name ends with before its number."""
_SOFT = ("bed", "sofa", "armchair")
_SOFT_COLOUR = "#7f9fb0"
_FABRIC = ("IfcWall", "IfcSlab", "IfcRoof", "IfcStair", "IfcDoor", "IfcWindow", "IfcColumn", "IfcDuctSegment")
_CUT_COLOUR = "#4a4f57"
_SIZE = (1000, 740)
_SMALL_SIZE = (640, 440)
_N_COLOURS, _N_COLOURS_DENSE = 256, 56
"""Enough for flat colours and shading; a third of the bytes of a full-colour PNG."""


@dataclass(frozen=True)
class View:
    """One picture: the parts whose storey is listed, cut at a height, seen from a direction."""

    file_name: str
    scene: str
    storeys: tuple[int, ...]
    cut_m: float
    seen_from: tuple[float, float, float]
    front_m: float = -99.0
    """What lies south of this y is cut away."""
    edges: bool = True
    """Draw the edges of everything; without, of the fabric only: furniture of real density would be black with them."""
    zoom: float = 1.0
    size: tuple[int, int] = _SIZE


def _small(
    scene: str,
    cut_m: float,
    seen_from: tuple[float, float, float] = (-0.4, -1.0, 1.6),
    *,
    front_m: float = -99.0,
    storeys: tuple[int, ...] = (0,),
    zoom: float = 1.2,
) -> View:
    """View of a puzzle or a hard scene, in a picture of its name."""
    return View(f"{scene}.png", scene, storeys, cut_m, seen_from, front_m, zoom=zoom, size=_SMALL_SIZE)


VIEWS = (
    View("house-outside.png", "house", (0, 1), 99.0, (-1.0, -1.7, 0.8)),
    View("house-ground-floor.png", "house", (0,), 2.15, (-0.55, -1.2, 1.9)),
    View("house-upper-floor.png", "house", (0, 1), 4.95, (-0.55, -1.2, 1.9)),
    View("basement.png", "basement", (0,), 3.3, (-0.5, -1.1, 1.9), edges=False, zoom=1.02),
    View(
        "school-section.png", "school", (0, 1, 2, 3, 4), 99.0, (-0.45, -1.5, 0.6), front_m=15.0, edges=False, zoom=1.3
    ),
    View("school-floor.png", "school", (0, 1), 7.6, (-0.35, -1.0, 1.5), edges=False, zoom=1.1),
    View("office.png", "office", (0,), 2.55, (-1.1, -0.75, 1.15), edges=False, zoom=1.35),
    _small("hole-walls", 1.9, (-0.5, -0.9, 1.3)),
    _small("convex-room", 2.0),
    _small("l-by-range", 2.0),
    _small("t-corridor", 2.0),
    _small("plus-corridor", 2.0),
    _small("comb-gallery", 2.0),
    _small("spiral", 2.0),
    _small("column-hall", 2.0),
    _small("glass-and-mirror", 2.3, (-0.5, -0.9, 1.4), zoom=1.1),
    _small("thin-walls", 2.0),
    _small("doors-open", 2.0),
    _small("doors-shut", 2.0),
    _small("stairwell", 99.0, (-0.5, -1.4, 0.45), front_m=2.6, storeys=(0, 1, 2), zoom=0.98),
    _small("double-height-hall", 5.3, (-0.4, -0.9, 1.3), storeys=(0, 1)),
    _small("atrium", 99.0, (-0.3, -1.4, 0.3), front_m=7.0, storeys=(0, 1, 2)),
    _small("tunnel", 99.0, (-1.0, -0.4, 0.2), front_m=0.0, zoom=2.2),
    _small("facade", 99.0, (-0.6, -1.4, 0.6), zoom=1.4),
)


def draw(synthetic: SyntheticScene, view: View, path: Path) -> None:
    """Render one view off-screen to a PNG."""
    plotter = pv.Plotter(off_screen=True, window_size=view.size, lighting="none")
    plotter.set_background("white")
    groups: dict[tuple[str, bool], list[Solid]] = {}
    for part in synthetic.parts:
        if part.storey in view.storeys:
            key = (_colour(part), view.edges or part.kind in _FABRIC)
            groups.setdefault(key, []).append(part.solid)
    for (colour, edges), solids in groups.items():
        _add(plotter, join(solids), colour, view, edges=edges)
    for direction, strength in (((-1.0, -2.0, 3.0), 0.75), ((2.0, -1.0, 2.0), 0.35), ((0.0, 2.0, 1.0), 0.3)):
        plotter.add_light(pv.Light(position=direction, light_type="scene light", intensity=strength))
    plotter.enable_ssao(radius=0.8, bias=0.02, kernel_size=64)
    plotter.enable_anti_aliasing("ssaa")
    middle = np.asarray(plotter.bounds).reshape(3, 2).mean(axis=1)
    plotter.camera.focal_point = middle
    plotter.camera.position = middle + 20 * np.asarray(view.seen_from)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.reset_camera()
    plotter.camera.zoom(view.zoom)
    image = Image.fromarray(plotter.screenshot(return_img=True, window_size=view.size))
    plotter.close()
    image.quantize(_N_COLOURS if view.edges else _N_COLOURS_DENSE).save(path, optimize=True)


def _colour(part: Part) -> str:
    if part.name.endswith(_SOFT):
        return _SOFT_COLOUR
    item = part.name.rstrip(" 0123456789")
    by_name = next((colour for word, colour in _BY_NAME if part.room and item.endswith(word)), None)
    return by_name or _COLOURS.get(part.kind, _OTHER_COLOUR)


def _add(plotter: pv.Plotter, solid: Solid, colour: str, view: View, *, edges: bool) -> None:
    """Add closed solids of one colour, cut and closed again at the view's planes."""
    faces = np.column_stack([np.full(len(solid.triangles), 3), solid.triangles])
    mesh = pv.PolyData(solid.vertices_m, faces.ravel())
    for axis, at, sign in ((2, view.cut_m, -1.0), (1, view.front_m, 1.0)):
        low, high = mesh.bounds[2 * axis : 2 * axis + 2]
        if (high <= at) if sign > 0 else (low >= at):
            return
        if (low < at) if sign > 0 else (high > at):
            mesh = _cut(plotter, mesh, axis, at, sign)
    plotter.add_mesh(mesh, color=colour, ambient=0.35, diffuse=0.8)
    if not edges:
        return
    lines = mesh.extract_feature_edges(25, boundary_edges=False, manifold_edges=False, non_manifold_edges=False)
    if lines.n_cells:
        plotter.add_mesh(lines, color="#33373d", line_width=1, lighting=False)


def _cut(plotter: pv.Plotter, mesh: pv.PolyData, axis: int, at_m: float, sign: float) -> pv.PolyData:
    """Keep what lies on the side `sign` of a plane, show the cut dark, and return the rest."""
    normal, origin = np.zeros(3), np.zeros(3)
    normal[axis], origin[axis] = sign, at_m
    mesh = mesh.clip_closed_surface(normal=normal, origin=origin)
    on_cut = np.abs(mesh.cell_centers().points[:, axis] - at_m) < 1e-6
    cap = mesh.extract_cells(on_cut)
    if cap.n_cells:
        plotter.add_mesh(cap, color=_CUT_COLOUR, lighting=False)
    return mesh.extract_cells(~on_cut).extract_surface()


def main(arguments: Sequence[str]) -> None:
    """Draw all views into the folder named by the only argument."""
    (folder,) = arguments
    Path(folder).mkdir(parents=True, exist_ok=True)
    for view in VIEWS:
        draw(scenes_synthetic.build(view.scene), view, Path(folder) / view.file_name)


if __name__ == "__main__":
    main(sys.argv[1:])
