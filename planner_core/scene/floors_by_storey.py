"""Floors of a scene that names its storeys (IFC): the slabs and coverings of each, or the plane at its elevation.

Local frame, metres. Geometry decides; names and predefined types only where it can't: what hangs is a ceiling, whatever
its top side looks like, and a level called `T.O. Steel` or `Ceiling-East` is a height to draw at, not one to stand on.

Roofs of lower wings lie in the open at the height of a storey, over rooms, and no way leads to them:

    storey's rooms |            | roof of a lower wing: beyond a wall with a sill, rooms below   -> no ground
    ===============|============|==============
                   | 0.7 m cut: a wall stands here, a doorway doesn't
    ===============:========      balcony, terrace: a door, or a window down to the floor, leads there  -> ground

Doors, windows and panes are no obstacles: whether they open is not modelled. So what only a curtain wall cuts off
stays.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Scene, Storey
from planner_core.scene.between_walls import MARGIN, cut_around_lines, lines_of
from planner_core.scene.ground_planes import RAISED_M, STAIR_KINDS, USED_KINDS, plane_pieces, with_missing_slabs
from planner_core.scene.level_surfaces import (
    MIN_AREA_M2,
    MIN_CLEAR_M,
    MIN_LEVEL_DISTANCE_M,
    SAME_HEIGHT_M,
    WALL_CUT_M,
    Ground,
    LevelSurvey,
    ground_of,
    main_height_m,
    mostly,
    once_a_surface,
)

#: IFC classes whose top sides are ground. IfcRoof is not: its slabs are classed IfcSlab only where flat roofs carry a
#: storey, and those are distinguished by what is above them.
FLOOR_KINDS = frozenset({"IfcSlab", "IfcSlabStandardCase", "IfcSlabElementedCase", "IfcCovering"})
#: IFC classes that enclose a storey. Columns, beams and roofs stand without a floor; so do doors and windows in a file
#: of nothing else.
WALL_KINDS = frozenset(
    {"IfcWall", "IfcWallStandardCase", "IfcWallElementedCase", "IfcCurtainWall", "IfcPlate", "IfcBuildingElementPart"}
)
#: Of them, those that doors and windows may be among, unclassed.
_PANES = frozenset({"IfcCurtainWall", "IfcPlate"})
#: What walls are called where a file knows no classes, or its program writes none.
_UNCLASSED = frozenset({"IfcBuildingElementProxy", "IfcProxy", "Mesh"})
#: Predefined types of coverings and slabs that are no floor. `FLOORING`, `TOPPING` and those without one stay.
_NOT_TO_STAND_ON = frozenset(
    {"CEILING", "CLADDING", "COPING", "INSULATION", "LANDING", "MEMBRANE", "MOLDING", "ROOFING"}
    | {"SKIRTINGBOARD", "SLEEVING", "WRAPPING"}
)
#: A storey's ground is the lowest of its surfaces that has this share of the largest: a suspended ceiling may be larger
#: than the ground under it, where that is on two heights.
_LOWEST_SHARE = 0.4
#: What begins no further below a storey's elevation is of that storey: floors are built up, and walls stand on slabs.
_FOOT_M = 0.5
#: Walls of a storey without slab are as long, at the cut, as three quarters of both sides of a wall around its bounds.
_ENCLOSED = 1.5
#: Slabs that lie higher above their storey than a split level, and make less of it than this share, are landings and
#: shelves over a ground that the file does not have.
_SPLIT_LEVEL_M, _SHELF_SHARE = 1.0, 0.2
#: What covers more of a storey's ground than this is its ceiling; a gallery or mezzanine covers less.
_CEILING_SHARE = 0.6
#: With less of its bounds under cover, a storey has no roof in the model: lintels and wall heads are no cover.
_ROOFED = 0.25
#: A hall is open over most of the storey that holds its upper walls, and most of these stand on walls.
_HALL_SHARE = 0.5
#: Walls that go on from below reach to this near below the elevation: no slab fits in.
_SLAB_GAP_M = 0.05
#: A wall stands on another one where their faces are within a thick wall's half of each other.
_WALL_OVER_WALL_M = 0.3
#: Names of levels that are no storeys to stand in, in the languages that models come in. Whole words: `Dachgeschoss`
#: and `attic` are storeys.
_NO_STOREY = re.compile(
    r"\b(roof|ceiling|parapet|footings?|foundations?|fdn|t\.?o\.?[sw]?|top of \w+|b\.?o\.?[sw]?|bottom of \w+"
    r"|dach|decken?|fundamente?|toit|toiture|plafond|fondations?|tetto|copertura|soffitto|fondazion[ei]"
    r"|cubierta|techo|cimentaci[oó]n|telhado|cobertura|teto|funda[cç][aã]o|dak|plafond|fundering|tak|katto"
    r"|кровля|крыша|потолок|фундамент)\b|屋根|屋上|天井|基礎",
    re.IGNORECASE,
)
#: Walls are searched for at this height above the floor: below sills and guards, which codes want at 0.8 m and more,
#: and above thresholds.
_SILL_M = 0.7
#: Ground goes on across gaps of this width: a facade that the model leaves out, between a floor and its balcony.
_GAP_M = 0.5
#: Covered ground is a room's where all open ground is farther away: eaves and canopies reach out less.
_EAVES_M = 1.5
#: A part is in the open, over rooms, or walled in where half of it, or of its outline, is.
_HALF = 0.5
#: Walls stand along an outline that is within this of them.
_ALONG_M = 0.3
#: Plumb lines farther apart than this miss doorways.
_WIDEST_STEP_M = 0.3


def grounds_of_storeys(survey: LevelSurvey, warnings: list[str]) -> list[Ground]:
    """Grounds of the storeys that are floors; `warnings` takes a line for each that is none or has no slab."""
    scene, columns = survey.scene, survey.columns
    element = scene.element_of_triangle[columns.triangle]
    storey = _storey_of_samples(survey, survey.storey_of_element[element])
    is_floor = survey.level[columns.triangle] & _may_be_ground(survey, element, storey)
    # The top of a slab: no other slab or covering within a raised floor's height above it.
    top = is_floor & (columns.clear_height_m(is_floor) > RAISED_M)
    clear = top & (survey.clear_m >= MIN_CLEAR_M)
    grounds, planes = [], []
    for index, named in enumerate(scene.storeys):
        ground, reason = _storey_ground(survey, named, top & (storey == index), clear & (storey == index))
        shelf = ground is not None and ground.elevation_m - named.elevation_m > _SPLIT_LEVEL_M
        if shelf or (ground is None and not reason):
            plane, why_none = _plane_of_storey(survey, index)
            if plane is not None and (ground is None or _hangs_over(ground, plane.ground)):
                planes.append(plane if ground is None else _with_mezzanine(plane, ground))
                continue
            reason = reason if ground is not None else why_none
        if ground is not None:
            grounds.append(with_missing_slabs(survey, index, ground, is_floor, warnings))
            warnings += [reason] if reason else []
        else:
            warnings.append(f"storey {named.name!r} is left out: {reason}")
    upper_walls = [plane for plane in planes if _is_upper_part_of_hall(survey, plane, grounds)]
    for plane in upper_walls:
        planes.remove(plane)
        warnings.append(
            f"storey {plane.ground.name!r} is left out: no floor slab, no door and no room, and its walls stand on "
            "those below, around a hall that is open up to the roof; if people walk there, load the file that has its "
            "slabs"
        )
    # Of two levels at one height the one with more walls is the storey.
    for plane in sorted(planes, key=lambda plane: -plane.wall_m):
        if not any(_same_level(plane.ground, other) for other in grounds):
            grounds.append(plane.ground)
    for ground in (plane.ground for plane in planes):
        if any(ground is other for other in grounds):
            elevation_m = ground.elevation_m + float(scene.offset_m[2])
            why = f"has no floor slab; its elevation {elevation_m:.3f} m is taken as the ground: the slabs may be in "
            warnings.append(f"storey {ground.name!r} {why}another discipline's file")
        else:
            beside = next(other for other in grounds if _same_level(ground, other))
            why = f"no floor slab, and it is {_beside_in_words(ground, beside)}"
            warnings.append(f"storey {ground.name!r} is left out: {why}")
    return grounds


@dataclass(frozen=True, eq=False)
class _Plane:
    """The plane of a storey without slabs, and its walls at the cut, both sides: length and segments (S, 2, 2)."""

    ground: Ground
    wall_m: float
    walls_m: FloatArray
    storey: int


def _lower_roofs(survey: LevelSurvey, ground: BoolArray, main_m: float, walls: BoolArray) -> BoolArray:
    """Tell which of a storey's ground is the roof of something lower.

    Parameters
    ----------
    ground
        (N,) bool, the storey's crossings with head-high space, one surface: none is far from `main_m`.
    main_m
        Height of the storey's ground.
    walls
        (E,) bool, elements that nobody walks through: walls, not doors, windows or panes.

    Returns
    -------
    (N,) bool, those of `ground`. None where nothing of it is in a room, or plumb lines are too far apart.
    """
    from scipy.ndimage import binary_dilation, distance_transform_edt, grey_dilation, label

    columns, step_m = survey.columns, survey.step_m
    none = np.zeros_like(ground)
    is_open = _plan(survey, ground & ~np.isfinite(survey.clear_m))
    if step_m > _WIDEST_STEP_M or not is_open.any():
        return none
    stands = ~survey.level & ~survey.stray
    sills = _cut(survey, stands & walls[survey.scene.element_of_triangle], main_m + _SILL_M)
    bare = _plan(survey, ground) & ~sills
    n_grow = max(1, round(0.5 * _GAP_M / step_m))
    part, n_parts = label(binary_dilation(bare, iterations=n_grow, mask=~sills))
    room = bare & ~is_open & (step_m * distance_transform_edt(~is_open) > _EAVES_M)
    below = survey.level[columns.triangle] & (survey.clear_m >= MIN_CLEAR_M)
    over_rooms = _plan(survey, below & (columns.z_m < main_m - MIN_LEVEL_DISTANCE_M))
    high = _cut(survey, stands, main_m + WALL_CUT_M)
    along = binary_dilation(high, iterations=max(1, round(_ALONG_M / step_m)))
    outline = np.where(part == 0, grey_dilation(part, footprint=[[0, 1, 0], [1, 1, 1], [0, 1, 0]]), 0)

    def share(cells: BoolArray, of: BoolArray, whose: BoolArray = part) -> FloatArray:
        """(n_parts + 1,) share of each part's cells `of` that are `cells`."""
        count = [np.bincount(whose[each], minlength=n_parts + 1) for each in (cells & of, of)]
        found: FloatArray = count[0] / np.maximum(count[1], 1)
        return found

    rooms_m2 = np.bincount(part[room], minlength=n_parts + 1) * survey.cell_m2
    is_floor = rooms_m2 >= MIN_AREA_M2
    if not is_floor.any():
        return none
    is_roof = ~is_floor & (share(is_open, bare) >= _HALF) & (share(over_rooms, bare) >= _HALF)
    is_roof &= share(along, outline > 0, outline) < _HALF
    roof = lines_of(is_roof[part])
    found = ground & roof.ravel()[columns.column]
    # What is under the walls that stand on a roof goes with the rest of its triangle.
    n_all, n_found = (np.bincount(columns.triangle[each], minlength=survey.level.size) for each in (ground, found))
    taken: BoolArray = found | (ground & (n_found > _HALF * n_all)[columns.triangle])
    return taken


def _beside_in_words(ground: Ground, beside: Ground) -> str:
    """How high a ground lies over another one that is too near for two floors."""
    off_m = ground.elevation_m - beside.elevation_m
    if abs(off_m) < SAME_HEIGHT_M:
        return f"at the height of {beside.name!r}"
    side = "above" if off_m > 0 else "below"
    return (
        f"only {abs(off_m):.2f} m {side} {beside.name!r}; two floors over each other are at least "
        f"{MIN_LEVEL_DISTANCE_M:g} m apart"
    )


def _may_be_ground(survey: LevelSurvey, element: Int32Array, storey: Int64Array) -> BoolArray:
    """(N,) bool: crossings of slabs, and of coverings that lie on something: what hangs below a slab is a ceiling."""
    elements, columns = survey.scene.elements, survey.columns
    ground = _is_ground_kind(survey)
    covering = np.array([e.kind == "IfcCovering" for e in elements], dtype=bool)
    flooring = np.array([e.predefined_type == "FLOORING" for e in elements], dtype=bool)
    slab = (ground & ~covering)[element]
    elevation_m = np.array([s.elevation_m for s in survey.scene.storeys])[storey]
    above_m = columns.z_m - elevation_m
    lies = (columns.depth_to_m(slab) <= RAISED_M) | ((above_m >= -SAME_HEIGHT_M) & (above_m <= RAISED_M))
    found: BoolArray = slab | ((ground & covering)[element] & (lies | flooring[element]))
    return found


def _is_ground_kind(survey: LevelSurvey) -> BoolArray:
    """(E,) bool: elements of a class, and predefined type, that people stand on."""
    elements = survey.scene.elements
    return np.array([e.kind in FLOOR_KINDS and e.predefined_type not in _NOT_TO_STAND_ON for e in elements], dtype=bool)


def _storey_of_samples(survey: LevelSurvey, source_storey: Int64Array) -> Int64Array:
    """Storey of each crossing: the source's where its elevation is within 1.5 m, else the highest one below."""
    elevation = np.array([s.elevation_m for s in survey.scene.storeys])
    z_m = survey.columns.z_m
    by_height = np.maximum(np.searchsorted(elevation, z_m + _FOOT_M, side="right") - 1, 0)
    named = source_storey >= 0
    near = named & (np.abs(z_m - elevation[np.where(named, source_storey, 0)]) <= 1.5)
    return np.where(near, source_storey, by_height)


def _storey_ground(survey: LevelSurvey, storey: Storey, top: BoolArray, clear: BoolArray) -> tuple[Ground | None, str]:
    """Ground of a storey from its slabs and what was left out; or None and why not; or None and nothing: no slabs."""
    columns = survey.columns
    if clear.sum() * survey.cell_m2 < MIN_AREA_M2:
        return None, ""
    covered = clear & np.isfinite(survey.clear_m)
    judged = covered if covered.sum() * survey.cell_m2 >= MIN_AREA_M2 else clear
    main_m = main_height_m(once_a_surface(columns, judged), lowest_share=_LOWEST_SHARE)
    main = clear & (np.abs(columns.z_m - main_m) <= SAME_HEIGHT_M)
    under_cover = float(np.isfinite(survey.clear_m[main]).mean())
    bounds = survey.bounds_of(np.unique(columns.triangle[main]))
    if under_cover < 0.5 and not survey.walls_around(bounds, main_m):
        if main_m - storey.elevation_m > _SPLIT_LEVEL_M:  # its roof; the file has no slab below
            return None, ""
        return None, f"its slabs are in the open ({100 * under_cover:.0f} % covered) and no walls stand on them"
    clear = clear & ~_decks_above(survey, clear, main, main_m)
    # Open-air parts stay where they continue the floor (balcony, terrace), not where they are another roof.
    far = np.abs(columns.z_m - main_m) > 0.6
    clear = clear & ~(far & ~np.isfinite(survey.clear_m))
    walls = np.array([e.kind in WALL_KINDS - _PANES for e in survey.scene.elements], dtype=bool)
    roofs = _lower_roofs(survey, clear & ~far, main_m, walls)
    clear = clear & ~roofs
    triangles = mostly(survey, clear, _is_ground_kind(survey)[survey.scene.element_of_triangle])
    shown = np.isin(columns.triangle, triangles)
    left_m2 = np.unique(columns.column[roofs & ~shown]).size * survey.cell_m2
    line = (
        f"storey {storey.name!r}: {left_m2:.0f} m2 in the open are left out, the roof of a lower wing: no door leads "
        "there; if people walk on it, mark it as ground"
    )
    return ground_of(survey, storey.name, "slab", triangles, top & shown, clear), line if left_m2 >= MIN_AREA_M2 else ""


def _hangs_over(ground: Ground, plane: Ground) -> bool:
    """Tell whether what a storey has of slabs, above a split level, hangs over ground that the file does not have."""
    is_shelf = ground.area_m2 < _SHELF_SHARE * plane.area_m2
    return is_shelf or ground.elevation_m - plane.elevation_m >= MIN_LEVEL_DISTANCE_M


def _with_mezzanine(plane: _Plane, ground: Ground) -> _Plane:
    """The plane of a storey with the mezzanine over it; with what hangs over it otherwise, the plane alone."""
    over = ground.area_m2 / plane.ground.area_m2
    if not _SHELF_SHARE <= over <= _CEILING_SHARE:
        return plane
    return replace(plane, ground=replace(plane.ground, triangles=ground.triangles))


def _decks_above(survey: LevelSurvey, clear: BoolArray, main: BoolArray, main_m: float) -> BoolArray:
    """Crossings of the storey that are its ceiling's top side: a level higher, over ground of the same storey.

    A gallery is smaller than the ground below it; what covers more of it is a ceiling. Coverings are never galleries.
    The roof's top, in the open, is judged apart: it is no sign of a gallery below it.
    """
    columns = survey.columns
    above = clear & (columns.z_m > main_m + MIN_LEVEL_DISTANCE_M)
    has_ground = np.zeros(columns.x_m.size * columns.y_m.size, dtype=bool)
    has_ground[columns.column[main]] = True
    over = above & has_ground[columns.column] & np.isfinite(survey.clear_m)
    if over.sum() > _CEILING_SHARE * main.sum():
        return above
    kinds: BoolArray = np.array([e.kind == "IfcCovering" for e in survey.scene.elements], dtype=bool)
    covering: BoolArray = kinds[survey.scene.element_of_triangle[columns.triangle]]
    return above & covering


def _is_wall(scene: Scene) -> BoolArray:
    """(E,) bool: walls by their class; in a scene where nothing is classed as one, what has no class."""
    is_wall = np.array([e.kind in WALL_KINDS for e in scene.elements], dtype=bool)
    return is_wall if is_wall.any() else np.array([e.kind in _UNCLASSED for e in scene.elements], dtype=bool)


def _same_level(plane: Ground, other: Ground) -> bool:
    """Tell whether a plane is nearer to another floor than two floors are, over a part of it at least."""
    low = np.maximum(plane.bounds_m[0], other.bounds_m[0])
    high = np.minimum(plane.bounds_m[1], other.bounds_m[1])
    return bool((high > low).all()) and abs(plane.elevation_m - other.elevation_m) < MIN_LEVEL_DISTANCE_M


def _walls_of_storey(survey: LevelSurvey, index: int) -> BoolArray:
    """(E,) bool: walls that enclose a storey: those that it contains, and those of others that stand on it.

    Programs contain walls in the storey that was open when they were drawn, in the building, or nowhere.
    """
    low_m, high_m = survey.spans_m
    elevation_m = np.array([s.elevation_m for s in survey.scene.storeys])
    named = survey.storey_of_element
    above_m = np.where(named >= 0, elevation_m[np.maximum(named, 0)], np.inf)
    stands_on_its_own = (low_m > above_m - MIN_LEVEL_DISTANCE_M) & (high_m > above_m + WALL_CUT_M)
    at_foot = np.maximum(np.searchsorted(elevation_m, low_m + _FOOT_M, side="right") - 1, 0)
    walls: BoolArray = _is_wall(survey.scene) & ((named == index) | (~stands_on_its_own & (at_foot == index)))
    return walls


def _plane_of_storey(survey: LevelSurvey, index: int) -> tuple[_Plane | None, str]:
    """Ground of a storey without slabs: the plane at its elevation, between its walls."""
    scene, columns = survey.scene, survey.columns
    storey = scene.storeys[index]
    if _NO_STOREY.search(storey.name):
        return None, "no floor slab, and its name is that of a roof, a ceiling, a foundation or a height to draw at"
    own = _walls_of_storey(survey, index)[scene.element_of_triangle] & ~survey.level & ~survey.stray
    wall_m, segments = survey.cut_of(own, storey.elevation_m + WALL_CUT_M)
    if segments.shape[0] == 0:
        return None, f"no floor slab, and none of its walls reaches {WALL_CUT_M} m above its elevation"
    plan = segments.reshape(-1, 2)
    bounds = np.stack([plan.min(axis=0), plan.max(axis=0)])
    if wall_m < _ENCLOSED * float((bounds[1] - bounds[0]).sum()):
        return None, "no floor slab and too few walls to be a storey to stand in"
    n_x = columns.x_m.size
    x, y = columns.x_m[columns.column % n_x], columns.y_m[columns.column // n_x]
    inside = (x >= bounds[0, 0]) & (x <= bounds[1, 0]) & (y >= bounds[0, 1]) & (y <= bounds[1, 1])
    above = inside & (columns.z_m > storey.elevation_m + 0.05)
    column, first = np.unique(columns.column[above], return_index=True)
    if column.size:
        # Three quarters, not the median: cupboards and tables stand in the way, low ceilings reach everywhere.
        clear_m = float(np.quantile(columns.z_m[above][first] - storey.elevation_m, 0.75))
        if clear_m < MIN_CLEAR_M:
            return None, f"no floor slab, and only {clear_m:.2f} m of clear height above its elevation"
    # Columns with nothing overhead lie outside an L-shaped house; a house without any roof is taken whole.
    if column.size * survey.cell_m2 < _ROOFED * float(np.prod(bounds[1] - bounds[0])):
        column = column[:0]
    pieces = plane_pieces(survey, bounds, storey.elevation_m, column)
    if not pieces.size:
        return None, f"no floor slab, and less than {MIN_AREA_M2:g} m2 in one piece is covered at its elevation"
    area_m2 = float(np.prod(pieces[:, 1] - pieces[:, 0], axis=1).sum())
    none = np.empty(0, dtype=np.int32)
    ground = Ground(storey.name, "storey-elevation", storey.elevation_m, none, area_m2, bounds, pieces)
    return _Plane(ground, wall_m, segments, index), ""


def _is_upper_part_of_hall(survey: LevelSurvey, plane: _Plane, grounds: list[Ground]) -> bool:
    """Tell whether a storey without slabs holds no more than the upper walls of a hall, whose slab is a ground below.

    A hall is open from its ground to above the plane, over most of the plane; its walls go on without the gap that a
    slab fills; and nothing that people use is at the plane's height: no door, stairs' end or furniture, no room.
    """
    scene, columns, elevation_m = survey.scene, survey.columns, plane.ground.elevation_m
    below = [g.triangles for g in grounds if g.elevation_m <= elevation_m - MIN_LEVEL_DISTANCE_M]
    if not below or any(room.storey == plane.storey for room in scene.rooms):
        return False
    open_up = np.isin(columns.triangle, np.concatenate(below)) & (columns.z_m + survey.clear_m > elevation_m)
    x = columns.x_m[columns.column % columns.x_m.size]
    y = columns.y_m[columns.column // columns.x_m.size]
    (x0, y0), (x1, y1) = plane.ground.bounds_m
    open_up &= (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
    open_m2 = np.unique(columns.column[open_up]).size * survey.cell_m2
    if open_m2 < _HALL_SHARE * plane.ground.area_m2 or _is_used_at(survey, elevation_m):
        return False
    walls = _is_wall(scene)[scene.element_of_triangle] & ~survey.level & ~survey.stray
    _, under_m = survey.cut_of(walls, elevation_m - _SLAB_GAP_M)
    if not under_m.size:
        return False
    away_m, _ = cKDTree(_along(under_m)).query(_along(plane.walls_m))
    return float((away_m <= _WALL_OVER_WALL_M).mean()) >= _HALL_SHARE


def _is_used_at(survey: LevelSurvey, elevation_m: float) -> bool:
    """Tell whether something stands at a height, or ends there, that only people on a floor use."""
    for element, (foot_m, top_m) in zip(survey.scene.elements, survey.spans_m.T.tolist(), strict=True):
        classes = {element.kind, *element.parents}
        at_m = top_m if classes & STAIR_KINDS else foot_m if classes & USED_KINDS else np.inf
        if abs(at_m - elevation_m) <= RAISED_M:
            return True
    return False


def _along(segments_m: FloatArray) -> FloatArray:
    """(N, 2) points of segments (S, 2, 2), no further apart than half of `_WALL_OVER_WALL_M`."""
    length_m = np.sqrt(((segments_m[:, 1] - segments_m[:, 0]) ** 2).sum(axis=1))
    count = np.ceil(2 * length_m / _WALL_OVER_WALL_M).astype(np.int64) + 1
    which = np.repeat(np.arange(count.size), count)
    share = (np.arange(which.size) - np.repeat(np.cumsum(count) - count, count)) / np.maximum(count[which] - 1, 1)
    points: FloatArray = segments_m[which, 0] + share[:, None] * (segments_m[which, 1] - segments_m[which, 0])
    return points


def _plan(survey: LevelSurvey, crossings: BoolArray) -> BoolArray:
    """(ny, nx) bool, with the margin: plumb lines with one of these crossings."""
    columns = survey.columns
    seen = np.zeros(columns.x_m.size * columns.y_m.size, dtype=np.bool_)
    seen[columns.column[crossings]] = True
    return np.pad(seen.reshape(columns.y_m.size, columns.x_m.size), MARGIN)


def _cut(survey: LevelSurvey, triangles: BoolArray, z_m: float) -> BoolArray:
    """(ny, nx) bool, with the margin: cells that the cut of triangles (T,) bool at the height z_m runs through."""
    return cut_around_lines(survey, survey.cut_of(triangles, z_m)[1])
