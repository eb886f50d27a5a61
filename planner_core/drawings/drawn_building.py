"""What drawings show of a building, as a document that people correct: walls, openings, stairs and texts by storey.

    drawings --recognition--> DrawnBuilding --raised--> Building --> IFC4
                                  |    ^
                                  +----+ corrections: the whole document with the next revision

Walls run through under doors and windows, which are cut out of them when the building is raised: so a door is moved or
deleted alone. Rooms follow from walls and openings. Plan coordinates, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from pydantic import Field

from planner_core.documents import Document, YesNo, document, read_as, words_of
from planner_core.drawings.building import LEAST_SLAB_M, Building, Doubtful, Heights, levels_of, lifted
from planner_core.drawings.floor_plan import FloorPlan
from planner_core.drawings.openings import Opening, OpeningKind
from planner_core.drawings.room_outlines import (
    SEAL_M,
    TRACED_SEAL_M,
    PlacedText,
    enclosed_by,
    rooms_of,
    sealed,
    slab_of,
)
from planner_core.drawings.stairs import Treads
from planner_core.drawings.walls import GRID_M, WallPiece, polygons_of
from planner_core.errors import RequirementError

SCHEMA: Literal["tlsplan:drawing:1"] = "tlsplan:drawing:1"
_DECIMALS = 4
_LEAST_WALL_M2, _LEAST_OPENING_M = 0.004, 0.2
_ON_WALL_SHARE = 0.8
"""Of a door or window that walls lie under."""
CUT_BEYOND_M = SEAL_M
"""Openings are cut this far beyond their faces: those of their walls differ from them by rounding, or by hand."""
_SAME_RECTANGLE = 1.005
"""Pieces of a wall on both sides of an opening are one wall, where the rectangle around is larger by no more."""
_FARTHEST_M = 100_000.0
_MOST_ELEMENTS, MOST_STOREYS, _MOST_CORNERS = 20_000, 200, 10_000

Metres = Annotated[float, Field(strict=True, ge=-_FARTHEST_M, le=_FARTHEST_M, allow_inf_nan=False)]
Length = Annotated[float, Field(strict=True, gt=0, le=1000, allow_inf_nan=False)]
Corner = tuple[Metres, Metres]
Ring = Annotated[tuple[Corner, ...], Field(min_length=3, max_length=_MOST_CORNERS)]
Id = Annotated[str, Field(min_length=1, max_length=32, pattern="^[A-Za-z][A-Za-z0-9_]*$")]
Words = Annotated[str, Field(max_length=500)]


@document
@dataclass(frozen=True)
class DrawnWall:
    """A wall, or a piece of one."""

    id: Id
    """Of one wall in its storey."""
    outline: Ring
    """Corners (x, y) of a simple polygon, without repeating the first."""
    holes: Annotated[tuple[Ring, ...], Field(max_length=1000)] = ()


@document
@dataclass(frozen=True)
class DrawnOpening:
    """A door, a window, or a passage without either."""

    id: Id
    """Of one opening in its storey."""
    kind: Literal["door", "window", "passage"]
    corners: Annotated[tuple[Corner, ...], Field(min_length=4, max_length=4)]
    """From a jamb along the opening: 0-1 and 2-3 lie in the wall's faces, 1-2 and 3-0 are the jambs."""
    name: Words = ""
    doubtful: YesNo = False
    """Nothing in the drawing shows what it is; of passages."""


@document
@dataclass(frozen=True)
class DrawnText:
    """A text, by which the room around it has its name."""

    text: Words
    at: Corner
    """Middle of its box."""


@document
@dataclass(frozen=True)
class DrawnStair:
    """The treads of a flight as this storey shows them."""

    foot: Corner
    """A corner; treads lie along `along`, and across to its left."""
    along: Corner
    """Unit vector."""
    run_m: Length
    width_m: Length


@document
@dataclass(frozen=True)
class DrawnStorey:
    """One storey."""

    name: Words
    elevation_m: Metres
    """Of its floor."""
    room_height_m: Length
    """From floor to ceiling: the height of its walls."""
    traced: YesNo
    """Recognised without named layers, as in pictures: walls and openings that miss each other by 12 cm close."""
    walls: Annotated[tuple[DrawnWall, ...], Field(max_length=_MOST_ELEMENTS)]
    openings: Annotated[tuple[DrawnOpening, ...], Field(max_length=_MOST_ELEMENTS)]
    texts: Annotated[tuple[DrawnText, ...], Field(max_length=_MOST_ELEMENTS)] = ()
    stairs: Annotated[tuple[DrawnStair, ...], Field(max_length=_MOST_ELEMENTS)] = ()


@document
@dataclass(frozen=True)
class DrawnFile:
    """A drawing that the building was recognised in."""

    name: Words
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class DrawnBuilding(Document):
    """A building as drawings show it, and as people corrected it."""

    schema_: Annotated[Literal["tlsplan:drawing:1"], Field(alias="schema")] = SCHEMA
    revision: Annotated[int, Field(strict=True, ge=0, le=2**53)] = 0
    """0: as recognised. Each correction that is saved counts one."""
    name: Words
    """Of the building in the IFC file."""
    files: Annotated[tuple[DrawnFile, ...], Field(max_length=1000)]
    doubtful: Annotated[Doubtful, words_of(Doubtful)] = Doubtful.AS_OPEN
    """What doubtful passages and stairs count as."""
    door_height_m: Length
    sill_height_m: Annotated[float, Field(strict=True, ge=0, le=1000, allow_inf_nan=False)]
    """Of windows, above the floor."""
    window_head_m: Length
    slab_m: Length
    """Thickness of the lowest and the highest slab; others reach from a ceiling to the next floor."""
    north_deg: Annotated[float, Field(strict=True, gt=-360, lt=360, allow_inf_nan=False)] | None = None
    """Direction of north in the plan, clockwise from +y; null: not known."""
    scale: Annotated[float, Field(strict=True, ge=1e-4, le=1e4, allow_inf_nan=False)] = 1.0
    """By which everything was enlarged since it was recognised; the lines of the drawing are, too."""
    storeys: Annotated[tuple[DrawnStorey, ...], Field(min_length=1, max_length=MOST_STOREYS)]
    """The lowest first."""


# ------------------------------------------------------------------------------------------------ making
def drawn_building(
    name: str,
    plans: Sequence[FloorPlan],
    files: Sequence[DrawnFile],
    heights: Heights,
    doubtful: Doubtful = Doubtful.AS_OPEN,
) -> DrawnBuilding:
    """Return the document of recognised storeys, the lowest first."""
    elevations_m, tops_m = levels_of(plans, heights)
    return DrawnBuilding(
        name=name,
        files=tuple(files),
        doubtful=doubtful,
        door_height_m=heights.door_m,
        sill_height_m=heights.sill_m,
        window_head_m=heights.window_head_m,
        slab_m=heights.slab_m,
        storeys=tuple(
            _storey(plan, plan.name or f"Level {number}", elevation_m, top_m - elevation_m)
            for number, (plan, elevation_m, top_m) in enumerate(zip(plans, elevations_m, tops_m, strict=True), 1)
        ),
    )


def _storey(plan: FloorPlan, name: str, elevation_m: float, room_height_m: float) -> DrawnStorey:
    openings = tuple(
        DrawnOpening(f"O{row}", opening.kind.value, _corners(opening.corners_m), opening.name, opening.is_doubtful)
        for row, opening in enumerate(plan.openings, 1)
    )
    return DrawnStorey(
        name=name,
        elevation_m=round(elevation_m, _DECIMALS),
        room_height_m=round(room_height_m, _DECIMALS),
        traced=plan.is_traced,
        walls=tuple(_wall(f"W{row}", area) for row, area in enumerate(_walls_through(plan), 1)),
        openings=openings,
        texts=tuple(DrawnText(text.text[:500], _corner(text.x, text.y)) for text in plan.texts),
        stairs=tuple(
            DrawnStair(_corner(*treads.foot), _corner(*treads.along, decimals=9), treads.run_m, treads.width_m)
            for treads in plan.treads
        ),
    )


def _walls_through(plan: FloorPlan) -> list[Any]:
    """Shapely areas of walls that run through under doors and windows, from the lowest corner."""
    areas = [wall.area for wall in plan.walls]
    for opening in plan.openings:
        if opening.kind == OpeningKind.PASSAGE:
            continue
        whole = opening.area
        # A wall on one side, and then on the other, goes on through the opening as one rectangle.
        for row in shapely.STRtree(areas).query(whole, predicate="dwithin", distance=2 * GRID_M).tolist():
            joined = shapely.union_all([whole, areas[row]], grid_size=GRID_M)
            box = shapely.oriented_envelope(joined)
            if box.geom_type == "Polygon" and box.area <= _SAME_RECTANGLE * joined.area:
                whole, areas[row] = box, shapely.Polygon()
        areas = [area for area in areas if not area.is_empty] + [whole]
    return sorted(areas, key=_place)


def _place(area: Any) -> tuple[float, ...]:
    return tuple(np.round(shapely.bounds(area), 3).tolist())


def _wall(id_: str, area: Any) -> DrawnWall:
    box = shapely.oriented_envelope(area)
    area = box if box.area <= _SAME_RECTANGLE * area.area else area  # without hairs of where pieces were parted
    rings = [_corners(shapely.get_coordinates(ring)[:-1]) for ring in (area.exterior, *area.interiors)]
    return DrawnWall(id_, rings[0], tuple(rings[1:]))


def _corners(points: Any) -> tuple[Corner, ...]:
    return tuple(_corner(x, y) for x, y in points.tolist())


def _corner(x: float, y: float, *, decimals: int = _DECIMALS) -> Corner:
    return round(float(x), decimals) + 0.0, round(float(y), decimals) + 0.0


# ----------------------------------------------------------------------------------------------- reading
def read_drawn(value: object, where: str) -> DrawnBuilding:
    """Read the document of a drawn building, and check that it can be raised.

    Parameters
    ----------
    where
        What messages begin with, such as `plan.drawing.json: `.

    Raises
    ------
    RequirementError
        In one line: another version, a value that does not fit, a wall without area, a door on no wall, storeys that
        overlap.
    """
    stated = value.get("schema") if isinstance(value, dict) else None
    if stated != SCHEMA:
        is_newer = isinstance(stated, str) and stated.startswith("tlsplan:drawing:")
        raise RequirementError(
            f"{where}got the schema {stated!r}, expected {SCHEMA!r}; "
            + ("it is of a newer version: update tlsplan" if is_newer else "it is no drawn building of tlsplan")
        )
    drawn = read_as(DrawnBuilding, value, where, remedy="correct it")
    _check_levels(drawn, where)
    for number, storey in enumerate(drawn.storeys):
        _check_storey(storey, f"{where}storeys[{number}]")
    return drawn


def _check_levels(drawn: DrawnBuilding, where: str) -> None:
    for number, (below, above) in enumerate(zip(drawn.storeys, drawn.storeys[1:], strict=False), 1):
        least_m = below.elevation_m + below.room_height_m + LEAST_SLAB_M
        if above.elevation_m < least_m - 1e-6:
            raise RequirementError(
                f"{where}storeys[{number}].elevation_m: got {above.elevation_m:g} m, expected {least_m:g} m or more, "
                f"above the ceiling of {below.name}; raise it, or lower that storey's walls"
            )


def _check_storey(storey: DrawnStorey, where: str) -> None:
    for kind, elements in (("walls", storey.walls), ("openings", storey.openings)):
        ids: set[str] = set()
        for each in elements:
            if each.id in ids:
                raise RequirementError(f"{where}.{kind}: got the id {each.id} twice, expected it once; rename one")
            ids.add(each.id)
    areas = []
    for wall in storey.walls:
        area = _area_of(wall)
        if not area.is_valid or area.area < _LEAST_WALL_M2:
            size_m2 = shapely.convex_hull(area).area
            got = f"{size_m2:.3g} m²" if size_m2 < _LEAST_WALL_M2 else "an outline that crosses itself"
            raise RequirementError(
                f"{where}: wall {wall.id}: got {got}, expected a simple outline of {_LEAST_WALL_M2:g} m² or more; draw "
                "it again, or delete it"
            )
        areas.append(area)
    tree = shapely.STRtree(areas)
    for opening in storey.openings:
        _check_opening(opening, areas, tree, f"{where}: {opening.kind} {opening.id}")


def _check_opening(opening: DrawnOpening, walls: Sequence[Any], tree: Any, where: str) -> None:
    area = shapely.Polygon(opening.corners)
    sides = np.hypot(*np.diff(np.array([*opening.corners[:3]]), axis=0).T)
    if not area.is_valid or area.area <= 0.0 or sides[0] < _LEAST_OPENING_M:
        raise RequirementError(
            f"{where}: got a width of {sides[0]:.3g} m, expected {_LEAST_OPENING_M:g} m or more; widen it, or delete it"
        )
    if opening.kind == "passage":
        return
    under = shapely.union_all([walls[row] for row in tree.query(area, predicate="intersects").tolist()])
    share = shapely.intersection(area, under).area / area.area
    if share < _ON_WALL_SHARE:
        raise RequirementError(
            f"{where}: got {100 * share:.0f} % of it on walls, expected {100 * _ON_WALL_SHARE:.0f} % or more; move it "
            "onto a wall, or delete it"
        )


# ----------------------------------------------------------------------------------------------- raising
def raised(drawn: DrawnBuilding) -> Building:
    """Raise a drawn building, to be written as IFC4.

    Raises
    ------
    SceneError
        Heights of doors and windows that exceed those of rooms.
    """
    heights = [
        Heights(
            room_m=storey.room_height_m,
            door_m=drawn.door_height_m,
            sill_m=drawn.sill_height_m,
            window_head_m=drawn.window_head_m,
            slab_m=drawn.slab_m,
        )
        for storey in drawn.storeys
    ]
    return lifted(
        drawn.name,
        [floor_plan_of(storey) for storey in drawn.storeys],
        [storey.elevation_m for storey in drawn.storeys],
        heights,
        drawn.doubtful,
        north_deg=drawn.north_deg,
    )


def floor_plan_of(storey: DrawnStorey) -> FloorPlan:
    """Return a storey with its openings cut out of its walls, and its rooms."""
    openings = tuple(
        Opening(OpeningKind(each.kind), np.array(each.corners), each.name, each.doubtful) for each in storey.openings
    )
    filled = shapely.union_all([opening.area for opening in openings])
    cut = shapely.union_all([_across_wall(opening) for opening in openings if not opening.is_doubtful])
    pieces: list[Any] = []
    for wall in storey.walls:
        area = _area_of(wall)
        if shapely.intersects(area, cut):
            area = polygons_of(shapely.difference(area, cut, grid_size=GRID_M))
        pieces += shapely.get_parts(area).tolist()
    pieces.sort(key=_place)
    texts = tuple(PlacedText(each.text, *each.at) for each in storey.texts)
    seal_m = TRACED_SEAL_M if storey.traced else SEAL_M
    walls = shapely.union_all(pieces, grid_size=GRID_M)
    rooms = tuple(rooms_of(walls, filled, texts, seal_m))
    enclosed = enclosed_by(sealed(walls, filled, seal_m), seal_m)
    slab = slab_of(enclosed)
    return FloorPlan(
        name=storey.name,
        walls=tuple(WallPiece(area, float("nan")) for area in pieces),
        openings=openings,
        rooms=rooms,
        outline=slab,
        treads=tuple(
            Treads(np.array(each.foot), np.array(each.along), each.run_m, each.width_m) for each in storey.stairs
        ),
        warnings=tuple(_open_walls(storey.name, len(rooms), enclosed, slab)),
        texts=texts,
        is_traced=storey.traced,
    )


def _open_walls(name: str, n_rooms: int, enclosed: Any, slab: Any) -> list[str]:
    remedy = "close the walls in the browser, or name the layers of doors and windows, such as --layer window=NAME."
    if slab is not enclosed:
        return [
            f"{name}: its walls enclose {enclosed.area:.0f} m² of the {slab.area:.0f} m² that they span; floor and "
            f"ceiling span all of it, open to the outside where no wall is drawn; {remedy}"
        ]
    if not n_rooms:
        return [f"{name}: its walls enclose no room, so nothing separates indoors from outdoors; {remedy}"]
    return []


def _across_wall(opening: Opening) -> Any:
    """What an opening takes out of its wall: a film that is left over a door would shut it for beams and feet."""
    corners_m = opening.corners_m
    across = corners_m[2] - corners_m[1]
    beyond = CUT_BEYOND_M * across / np.hypot(*across)
    return shapely.Polygon(corners_m + np.array([-beyond, -beyond, beyond, beyond]))


def _area_of(wall: DrawnWall) -> Any:
    return shapely.Polygon(wall.outline, wall.holes)
