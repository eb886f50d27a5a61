"""Where on earth an IFC file is: map conversion, coordinate reference system, site and true north.

Input: IfcOpenShell's entities, which the caller guards against files that do not follow their schema. Output:
`Georeference`, from metres of the file's unit to metres on the map. Sources: IFC4 ADD2 TC1 and IFC4X3 ADD2,
IfcMapConversion; for IFC2X3, the property sets of buildingSMART's "User Guide for Geo-referencing in IFC".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Georeference
from planner_core.model.site_frame import unit_named

_GRID_SCALE = (0.99, 1.01)
"""Scales of map projections, heights included, lie far inside."""
_ROUNDED = 5e-8
_WHOLE_DEGREES = (90.0, 180.0)


@dataclass(frozen=True)
class _Operation:
    """A coordinate operation as the file has it: lengths in its map unit, scales from project unit to map unit."""

    name: str
    shift: tuple[float, float, float]
    x_axis: tuple[float, float]
    scale: float
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class _Crs:
    """A coordinate reference system as the file has it.

    unit_m : of its map unit; None: not given. named_m : of the unit that its name stands for, where that is another.
    """

    name: str = ""
    text: str = ""
    description: str = ""
    geodetic_datum: str = ""
    vertical_datum: str = ""
    projection: str = ""
    zone: str = ""
    unit: str = ""
    unit_m: float | None = None
    named_m: float | None = None


def read_georeference(name: str, model: Any, unit_m: float) -> Georeference | None:
    """Return the model's georeference; None where it has none.

    Parameters
    ----------
    name
        Of the file, for warnings.
    unit_m
        Metres of the project's length unit.
    """
    context = _context(model)
    world = _world(context, unit_m)
    warnings: list[str] = []
    operation, crs = (
        _from_property_sets(model) if model.schema == "IFC2X3" else _from_operation(name, model, context, warnings)
    )
    to_map = None if operation is None else _matrix(name, operation, crs, unit_m, world, warnings)
    site = _site(name, model, unit_m, warnings)
    north = _true_north(context, world)
    if operation is None and not crs.name and north is None and not any(site) and not warnings:
        return None
    latitude, longitude, elevation_m, position_m = site
    return Georeference(
        operation="" if operation is None else operation.name,
        to_map=None if to_map is None else tuple(tuple(float(value) for value in row) for row in to_map),
        crs_name=crs.name,
        crs_text=crs.text,
        description=crs.description,
        geodetic_datum=crs.geodetic_datum,
        vertical_datum=crs.vertical_datum,
        map_projection=crs.projection,
        map_zone=crs.zone,
        map_unit=crs.unit,
        site_latitude_deg=latitude,
        site_longitude_deg=longitude,
        site_elevation_m=elevation_m,
        site_position_m=position_m,
        true_north=north,
        warnings=tuple(warnings),
    )


# ------------------------------------------------------------------------------------------------ operation
def _context(model: Any) -> Any:
    """The context of the 3D model; None where there is none."""
    contexts = sorted(
        model.by_type("IfcGeometricRepresentationContext", include_subtypes=False), key=lambda c: int(c.id())
    )
    return next((c for c in contexts if c.ContextType == "Model"), contexts[0] if contexts else None)


def _from_operation(name: str, model: Any, context: Any, warnings: list[str]) -> tuple[_Operation | None, _Crs]:
    operations = sorted(model.by_type("IfcCoordinateOperation"), key=lambda o: int(o.id()))
    of_context = [o for o in operations if context is not None and o.SourceCRS == context] or operations
    if not of_context:
        systems = sorted(model.by_type("IfcCoordinateReferenceSystem"), key=lambda s: int(s.id()))
        return None, _crs(systems[0]) if systems else _Crs()
    if len(operations) > 1:
        warnings.append(
            f"{name} has {len(operations)} coordinate operations: #{of_context[0].id()} ({of_context[0].is_a()}) "
            "is used."
        )
    return _operation(name, of_context[0], warnings), _crs(of_context[0].TargetCRS)


def _operation(name: str, entity: Any, warnings: list[str]) -> _Operation | None:
    if entity.is_a("IfcMapConversion"):
        scaled = entity.is_a("IfcMapConversionScaled")
        return _Operation(
            name=str(entity.is_a()),
            shift=(_real(entity.Eastings), _real(entity.Northings), _real(entity.OrthogonalHeight)),
            x_axis=(_real(entity.XAxisAbscissa), _real(entity.XAxisOrdinate)),
            scale=_real(entity.Scale) or 1.0,
            factors=(_real(entity.FactorX), _real(entity.FactorY), _real(entity.FactorZ)) if scaled else (1.0,) * 3,
        )
    if entity.is_a("IfcRigidOperation") and not entity.FirstCoordinate.is_a("IfcPlaneAngleMeasure"):
        first, second = entity.FirstCoordinate.wrappedValue, entity.SecondCoordinate.wrappedValue
        return _Operation("IfcRigidOperation", (_real(first), _real(second), _real(entity.Height)), (1.0, 0.0), 1.0)
    warnings.append(
        f"{name}: its coordinate operation #{entity.id()} ({entity.is_a()}) gives no easting and northing: it is not "
        "used."
    )
    return None


def _crs(entity: Any) -> _Crs:
    if entity is None:
        return _Crs()
    from ifcopenshell.util import unit as units

    unit = getattr(entity, "MapUnit", None)
    unit_m = None if unit is None else float(units.get_unit_scale(unit))
    unit_words = "" if unit is None else str(units.get_full_unit_name(unit)).lower()
    texts = getattr(entity, "WellKnownText", None) or ()
    return _Crs(
        name=_text(entity.Name),
        text=_text(texts[0].WellKnownText) if texts else "",
        description=_text(entity.Description),
        geodetic_datum=_text(entity.GeodeticDatum),
        vertical_datum=_text(getattr(entity, "VerticalDatum", None)),
        projection=_text(getattr(entity, "MapProjection", None)),
        zone=_text(getattr(entity, "MapZone", None)),
        unit=unit_words,
        unit_m=unit_m,
        named_m=None if unit_m is None else other_length_of_name(unit_words, unit_m),
    )


def other_length_of_name(name: str, unit_m: float) -> float | None:
    """Metres of the unit that is called so, where that is another length than `unit_m`; None: they agree, or no unit.

    Programs write conversion-based units named METER with the factor of a foot. The two feet are distinguished by their
    factors alone: both are called FOOT.
    """
    metres = _metres_of(name)
    return None if metres is None or math.isclose(metres, unit_m, rel_tol=1e-5) else metres


def _from_property_sets(model: Any) -> tuple[_Operation | None, _Crs]:
    """IFC2X3 has no such classes; property sets of the project, or of the site, stand for them."""
    from ifcopenshell.util.element import get_psets

    sets: dict[str, dict[str, Any]] = {}
    for holder in (*model.by_type("IfcSite"), *model.by_type("IfcProject")):  # the project's word counts
        sets.update((key.lower(), values) for key, values in get_psets(holder, psets_only=True).items())
    entries = sets.get("epset_mapconversion")
    system = sets.get("epset_projectedcrs", {})
    unit = _text(system.get("MapUnit"))
    crs = _Crs(
        name=_text(system.get("Name")),
        description=_text(system.get("Description")),
        geodetic_datum=_text(system.get("GeodeticDatum")),
        vertical_datum=_text(system.get("VerticalDatum")),
        projection=_text(system.get("MapProjection")),
        zone=_text(system.get("MapZone")),
        unit=unit.lower(),
        unit_m=_metres_of(unit),
    )
    if entries is None:
        return None, crs
    operation = _Operation(
        name="ePset_MapConversion",
        shift=(_real(entries.get("Eastings")), _real(entries.get("Northings")), _real(entries.get("OrthogonalHeight"))),
        x_axis=(_real(entries.get("XAxisAbscissa")), _real(entries.get("XAxisOrdinate"))),
        scale=_real(entries.get("Scale")) or 1.0,
    )
    return operation, crs


def _metres_of(unit: str) -> float | None:
    """Metres of a unit by its name; None: not known."""
    named = unit_named(unit)
    if named is not None:
        return named.metres
    small = {"millimetre": 0.001, "mm": 0.001, "centimetre": 0.01, "cm": 0.01}
    return small.get(unit.lower().replace("meter", "metre").rstrip("s"))


# --------------------------------------------------------------------------------------------------- matrix
def _matrix(
    name: str, operation: _Operation, crs: _Crs, unit_m: float, world: FloatArray, warnings: list[str]
) -> FloatArray | None:
    """(4, 4) metres to metres; None where the numbers make no sense."""
    numbers = (*operation.shift, *operation.x_axis, operation.scale, *operation.factors)
    if not all(math.isfinite(value) for value in numbers) or min(operation.scale, *operation.factors) <= 0:
        warnings.append(f"{name}: its {operation.name} has no usable numbers ({operation}): it is not used.")
        return None
    if crs.named_m is not None:
        decided = _one_reading(name, operation, crs, unit_m, warnings)
        if decided is None:
            return None
        crs = decided
    scale, map_m = _scale(name, operation, crs, unit_m, warnings)
    x, y = operation.x_axis
    angle = math.atan2(y, x) if x or y else 0.0
    turn = np.array([[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0, 0, 1.0]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * (scale * np.array(operation.factors))
    matrix[:3, 3] = np.array(operation.shift) * map_m
    if abs(scale * operation.factors[2] - 1.0) > _ROUNDED:  # feet to metres, written in digits, come to be nearly 1
        ppm = (scale * operation.factors[2] - 1.0) * 1e6
        warnings.append(
            f"{name}: its {operation.name} scales heights, too, by {ppm:+.1f} ppm: site heights are not true to scale."
        )
    return np.asarray(matrix @ np.linalg.inv(world))


def _one_reading(name: str, operation: _Operation, crs: _Crs, unit_m: float, warnings: list[str]) -> _Crs | None:
    """The system with the one length of its map unit, by factor or by name, that fits the scale; None: none or both."""
    low, high = _GRID_SCALE
    lengths_m = (crs.unit_m, crs.named_m)
    fitting = [m for m in lengths_m if m is not None and low < operation.scale * m / unit_m < high]
    doubt = f"{name}: its map unit is named {crs.unit.upper()} and is {crs.unit_m:g} m long by its factor: "
    if len(fitting) != 1:
        warnings.append(
            f"{doubt}its {operation.name} is not used; correct the unit, or give the coordinates with --origin or "
            "--control-points."
        )
        return None
    warnings.append(
        f"{doubt}{fitting[0]:g} m is taken, which fits the scale of its {operation.name}; check its coordinates."
    )
    return replace(crs, unit_m=fitting[0], named_m=None)


def _scale(name: str, operation: _Operation, crs: _Crs, unit_m: float, warnings: list[str]) -> tuple[float, float]:
    """Map metres of one metre of the file, less the factors; and metres of the map's unit.

    The file's scale holds the step from its project unit to the map unit. Files in millimetres often leave that out,
    or leave out the map unit; read by the letter, their building would be a thousand times too large or small.
    """
    map_m = unit_m if crs.unit_m is None else crs.unit_m
    low, high = _GRID_SCALE
    by_letter = operation.scale * map_m / unit_m
    if low < by_letter < high:
        return by_letter, map_m
    if crs.unit_m is None and low < operation.scale / unit_m < high:
        warnings.append(
            f"{name}: its {operation.name} has a scale of {operation.scale:g} and no map unit: the map is taken to be "
            "in metres."
        )
        return operation.scale / unit_m, 1.0
    if low < operation.scale < high:
        warnings.append(
            f"{name}: its {operation.name} has a scale of {operation.scale:g}, with lengths of {unit_m:g} m and a map "
            f"in units of {map_m:g} m: the unit conversion is taken to be missing."
        )
        return operation.scale, map_m
    warnings.append(
        f"{name}: its {operation.name} makes a metre {by_letter:g} m on the map, expected about 1: it has wrong units; "
        "correct the file, or give the coordinates with --origin or --control-points."
    )
    return by_letter, map_m


def _world(context: Any, unit_m: float) -> FloatArray:
    """(4, 4) in metres: where the context's origin is in the coordinates of placements; mostly the identity."""
    system = None if context is None else context.WorldCoordinateSystem
    if system is None or not system.is_a("IfcAxis2Placement3D"):
        return np.eye(4)
    from ifcopenshell.util.placement import get_axis2placement

    world = np.array(get_axis2placement(system), dtype=np.float64)
    world[:3, 3] *= unit_m
    return world


# ----------------------------------------------------------------------------------------------------- site
_Site = tuple[float | None, float | None, float | None, tuple[float, float, float] | None]


def _site(name: str, model: Any, unit_m: float, warnings: list[str]) -> _Site:
    """Latitude, longitude (degrees), elevation (m) and position (m) of the first site that has a position on earth."""
    from ifcopenshell.util.placement import get_local_placement

    for site in sorted(model.by_type("IfcSite"), key=lambda s: int(s.id())):
        latitude, longitude = _degrees(site.RefLatitude), _degrees(site.RefLongitude)
        if latitude is None or longitude is None or (latitude == 0 and longitude == 0):
            continue
        if not (abs(latitude) <= _WHOLE_DEGREES[0] and abs(longitude) <= _WHOLE_DEGREES[1]):
            warnings.append(
                f"{name}: its site lies at {latitude:g} N, {longitude:g} E, which is not on Earth: not used."
            )
            continue
        elevation_m = None if site.RefElevation is None else _real(site.RefElevation) * unit_m
        placed = np.eye(4) if site.ObjectPlacement is None else get_local_placement(site.ObjectPlacement)
        x, y, z = (float(value) * unit_m for value in placed[:3, 3])
        return latitude, longitude, elevation_m, (x, y, z)
    return None, None, None, None


def _degrees(parts: Any) -> float | None:
    """Degrees, minutes, seconds and millionths of seconds, of one sign all; zeros have no sign of their own."""
    if not parts:
        return None
    size: float = sum(abs(part) / unit for part, unit in zip(parts, (1.0, 60.0, 3600.0, 3.6e9), strict=False))
    return -size if any(part < 0 for part in parts) else size


def _true_north(context: Any, world: FloatArray) -> tuple[float, float] | None:
    """(x, y) of length 1, in the coordinates of placements."""
    direction = None if context is None else getattr(context, "TrueNorth", None)
    if direction is None:
        return None
    ratios = [_real(value) for value in direction.DirectionRatios]
    x, y, _ = world[:3, :3] @ np.array([ratios[0], ratios[1], 0.0])
    length = math.hypot(x, y)
    return (float(x / length), float(y / length)) if length > 0 and math.isfinite(length) else None


def _real(value: Any) -> float:
    return 0.0 if value is None else float(value)


def _text(value: Any) -> str:
    return "" if value is None else " ".join(str(value).split())
