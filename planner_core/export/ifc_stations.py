"""A plan's stations as IFC: a small IFC4 file of storeys and stations alone, or a copy of the plan's own IFC file.

Each station is an IfcBuildingElementProxy whose placement is the sensor, a scanner on its tripod, contained in its
storey, with the property set `TLSPLAN_Station`. Model coordinates are the scene's; where the site is, the file states
by IfcMapConversion. Ids follow from names (RFC 4122, version 5), the header has no time: same plan, same bytes.
"""

from __future__ import annotations

import math
import uuid
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import ExportError, MissingPackageError, SceneError
from planner_core.export.chosen import chosen_floors, chosen_stations
from planner_core.export.options import Options
from planner_core.model import US_SURVEY_FOOT, FloatArray, LengthUnit, SiteFrame
from planner_core.plan_folder import palette
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.plan_folder.tripod import tripod
from planner_core.progress import Progress, ProgressEvent
from planner_core.scene.isolated_readers import open_tried

try:
    import ifcopenshell
    import ifcopenshell.guid
    import ifcopenshell.util.placement
    import ifcopenshell.util.unit
except ImportError as error:
    raise MissingPackageError(
        f"IFC needs the package ifcopenshell, which can't be imported ({error}): pip install ifcopenshell"
    ) from error

PSET = "TLSPLAN_Station"
OBJECT_TYPE = "Scanner station"

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_OID, "tlsplan handover ifc")
_TIME = "2000-01-01T00:00:00"
#: Coordinates are rounded to 0.1 mm.
_DECIMALS = 4
#: Two heights of a turn and a scale that differ by less are one: a map conversion of IFC has one scale.
_SAME_SCALE = 1e-9
#: A storey this near to a floor is the floor's.
_SAME_HEIGHT_M = 1.0


def write_ifc(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write stations and storeys of the chosen floors as IFC4, metres. Returns remarks.

    Raises
    ------
    RequirementError
        A floor that is not there.
    """
    model = ifcopenshell.file(schema="IFC4")
    target = _Target(model, plan.title, metres_per_unit=1.0)
    body, building = _new_project(target, plan)
    remarks = _place_on_map(target, plan.frame, body.ParentContext)
    storeys = {}
    for floor in chosen_floors(plan, options):
        storeys[floor.id] = _new_storey(target, floor.name, floor.id, floor.elevation_m, building.ObjectPlacement)
    if storeys:
        target.relate("IfcRelAggregates", "storeys", RelatingObject=building, RelatedObjects=list(storeys.values()))
    _add_stations(target, plan, chosen_stations(plan, options), storeys, building, body, progress)
    model.header.file_description.description = ("ViewDefinition [NotAssigned]",)
    header = model.header.file_name
    header.name, header.time_stamp = f"{Path(plan.title).stem}-stations.ifc", _TIME
    header.author, header.organization = ("",), ("",)
    header.preprocessor_version = header.originating_system = "tlsplan"
    header.authorization = ""
    model.write(path, format=".ifc")
    return remarks


def write_ifc_model(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write a copy of the plan's IFC file, in its schema and units, with the stations in its storeys. Returns remarks.

    Of several files it is the first, whose frame is the plan's.

    Raises
    ------
    ExportError
        The plan's scene is no IFC file, or not found.
    RequirementError
        A floor that is not there.
    """
    source = _source_model(plan)
    target = _Target(source, plan.title, metres_per_unit=float(plan.document["scene"]["metres_per_unit"]))
    body = _body_context(source)
    if body is None:
        raise ExportError(f"{plan.title}: has no geometric context, expected one for 3D models; use format ifc")
    remarks = []
    n_others = len(plan.document["scene"].get("other_files", ()))
    if n_others:
        first = plan.scene_paths()[0].name
        remarks.append(f"{first}, the first of {n_others + 1} files, is what the stations are written into")
    storeys = {}
    for floor in chosen_floors(plan, options):
        storey = _storey_of(source, target, floor.name, floor.elevation_m)
        if storey is None:
            remarks.append(f"{plan.title} has no storey for floor {floor.name}: its stations are in the building")
        else:
            storeys[floor.id] = storey
    (*_, spatial) = [*source.by_type("IfcProject"), *source.by_type("IfcSite"), *source.by_type("IfcBuilding")][-1:]
    if not spatial.is_a("IfcSpatialStructureElement") and len(storeys) < len(chosen_floors(plan, options)):
        raise ExportError(f"{plan.title}: has no building, expected one that stations can be in; use format ifc")
    _add_stations(target, plan, chosen_stations(plan, options), storeys, spatial, body, progress)
    source.write(path, format=".ifc")
    return tuple(remarks)


@dataclass(eq=False)
class _Target:
    """A file that stations are put into. metres_per_unit : of its lengths."""

    model: Any
    name: str
    metres_per_unit: float
    _shapes: dict[float, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.schema = str(self.model.schema)
        self._owner = self._owner_history()
        self._taken = {entity.GlobalId for entity in self.model.by_type("IfcRoot")}
        self.metre = self.model.create_entity("IfcSIUnit", None, "LENGTHUNIT", None, "METRE")
        self.square_metre = self.model.create_entity("IfcSIUnit", None, "AREAUNIT", None, "SQUARE_METRE")

    def _owner_history(self) -> Any:
        """What IFC2X3 wants to know of every object: who made it. The file's own first one; later schemas need none."""
        if self.schema != "IFC2X3":
            return None
        there = self.model.by_type("IfcOwnerHistory")
        if there:
            return there[0]
        person = self.model.create_entity("IfcPerson", FamilyName="tlsplan")
        firm = self.model.create_entity("IfcOrganization", Name="tlsplan")
        who = self.model.create_entity("IfcPersonAndOrganization", person, firm)
        program = self.model.create_entity("IfcApplication", firm, "1", "tlsplan", "tlsplan")
        return self.model.create_entity("IfcOwnerHistory", who, program, ChangeAction="ADDED", CreationDate=0)

    def rooted(self, ifc_class: str, key: str, **attributes: Any) -> Any:
        """Create an object whose id follows from its class and `key`; from more where a file of ours is written to."""
        guid = ""
        while not guid or guid in self._taken:
            guid = ifcopenshell.guid.compress(uuid.uuid5(_NAMESPACE, f"{self.name}/{ifc_class}/{key}{guid}").hex)
        self._taken.add(guid)
        return self.model.create_entity(ifc_class, GlobalId=guid, OwnerHistory=self._owner, **attributes)

    def relate(self, ifc_class: str, key: str, **attributes: Any) -> Any:
        """Create a relation; as `rooted`."""
        return self.rooted(ifc_class, key, **attributes)

    def units(self, lengths_m: FloatArray) -> list[float]:
        """Lengths in the file's units, rounded to a micrometre: turned placements keep their tenth of a millimetre."""
        digits = 6 + round(math.log10(self.metres_per_unit))
        return [float(value) for value in np.round(np.asarray(lengths_m) / self.metres_per_unit, max(digits, 0))]

    def placement(self, at_m: FloatArray, parent: Any) -> Any:
        """Place something at (3,), scene frame, parallel to its axes, relative to another placement or to nothing."""
        matrix = np.eye(4)
        matrix[:3, 3] = np.asarray(at_m) / self.metres_per_unit
        if parent is not None:
            matrix = np.linalg.solve(ifcopenshell.util.placement.get_local_placement(parent), matrix)
        turned = np.abs(matrix[:3, :3] - np.eye(3)).max() > 1e-9
        axes = [self.direction(matrix[:3, 2]), self.direction(matrix[:3, 0])] if turned else [None, None]
        location = self.point(matrix[:3, 3] * self.metres_per_unit)
        where = self.model.create_entity("IfcAxis2Placement3D", location, *axes)
        return self.model.create_entity("IfcLocalPlacement", parent, where)

    def point(self, at_m: FloatArray) -> Any:
        """A point (3,)."""
        return self.model.create_entity("IfcCartesianPoint", self.units(at_m))

    def direction(self, towards: FloatArray) -> Any:
        """A direction (3,)."""
        return self.model.create_entity("IfcDirection", [float(value) for value in np.round(towards, 12)])

    def shape(self, height_m: float, body: Any) -> Any:
        """Return the shape of a scanner at an instrument height: one for all stations of the same."""
        known = round(height_m, _DECIMALS) if math.isfinite(height_m) else -1.0
        if known not in self._shapes:
            item = self._solid(*tripod(height_m))
            kind = "Brep" if self.schema == "IFC2X3" else "Tessellation"
            of = self.model.create_entity("IfcShapeRepresentation", body, "Body", kind, [item])
            origin = self.model.create_entity("IfcAxis2Placement3D", self.point(np.zeros(3)))
            self._shapes[known] = self.model.create_entity("IfcRepresentationMap", origin, of)
        as_it_is = self.model.create_entity(
            "IfcCartesianTransformationOperator3D", LocalOrigin=self.point(np.zeros(3)), Scale=1.0
        )
        mapped = self.model.create_entity("IfcMappedItem", self._shapes[known], as_it_is)
        drawn = self.model.create_entity("IfcShapeRepresentation", body, "Body", "MappedRepresentation", [mapped])
        return self.model.create_entity("IfcProductDefinitionShape", None, None, [drawn])

    def _solid(self, vertices_m: FloatArray, triangles: Any) -> Any:
        create = self.model.create_entity
        if self.schema == "IFC2X3":
            points = [self.point(vertex) for vertex in vertices_m]
            faces = []
            for corners in triangles.tolist():
                loop = create("IfcPolyLoop", [points[corner] for corner in corners])
                faces.append(create("IfcFace", [create("IfcFaceOuterBound", loop, True)]))
            item = create("IfcFacetedBrep", create("IfcClosedShell", faces))
        else:
            places = create("IfcCartesianPointList3D", [self.units(vertex) for vertex in vertices_m])
            corners = (triangles + 1).tolist()
            item = create("IfcTriangulatedFaceSet", Coordinates=places, Closed=True, CoordIndex=corners)
        red, green, blue = palette.STATION
        colour = create("IfcColourRgb", None, round(red, 4), round(green, 4), round(blue, 4))
        look = create("IfcSurfaceStyle", "Scanner station", "BOTH", [self._shading(colour)])
        styles = [create("IfcPresentationStyleAssignment", [look])] if self.schema == "IFC2X3" else [look]
        create("IfcStyledItem", item, styles)
        return item

    def _shading(self, colour: Any) -> Any:
        if self.schema == "IFC2X3":
            return self.model.create_entity("IfcSurfaceStyleShading", colour)
        return self.model.create_entity("IfcSurfaceStyleShading", colour, 0.0)


# ------------------------------------------------------------------------------------------------ stations
def _add_stations(
    target: _Target,
    plan: PlanSource,
    stations: tuple[FieldStation, ...],
    storeys: dict[str, Any],
    elsewhere: Any,
    body: Any,
    progress: Progress,
) -> None:
    """Put stations into the storeys of their floors, by id; into `elsewhere` where a floor has none."""
    contained: dict[str, list[Any]] = {}
    spatial: dict[str, Any] = {}
    for number, station in enumerate(stations):
        progress(ProgressEvent("ifc", number, len(stations), station.id))
        where = storeys.get(station.floor_id, elsewhere)
        proxy = target.rooted(
            "IfcBuildingElementProxy",
            f"station/{station.id}",
            Name=station.id,
            Description=f"Station {station.order} on the route",
            ObjectType=OBJECT_TYPE,
            ObjectPlacement=target.placement(station.position_m, where.ObjectPlacement),
            Representation=target.shape(station.instrument_height_m, body),
            Tag=str(station.number),
        )
        if target.schema != "IFC2X3":
            proxy.PredefinedType = "USERDEFINED"
        _attach(target, plan, station, proxy)
        contained.setdefault(where.GlobalId, []).append(proxy)
        spatial[where.GlobalId] = where
    for storey_id, proxies in contained.items():
        target.relate(
            "IfcRelContainedInSpatialStructure",
            f"stations in {storey_id}",
            RelatedElements=proxies,
            RelatingStructure=spatial[storey_id],
        )
    progress(ProgressEvent("ifc", len(stations), len(stations)))


def _attach(target: _Target, plan: PlanSource, station: FieldStation, proxy: Any) -> None:
    """Attach the station's figures, unknown ones left out.

    Site coordinates and heights are metres, areas square metres, whatever the units of the file.
    """
    east_m, north_m, sensor_m = (float(value) for value in station.site_m)
    rows: list[tuple[str, str, Any, Any]] = [
        ("Id", "IfcIdentifier", station.id, None),
        ("Number", "IfcInteger", station.number, None),
        ("Floor", "IfcLabel", station.floor_name, None),
        ("State", "IfcLabel", "scanned before" if station.id in plan.scanned_before else "planned", None),
        ("CoordinateSystem", "IfcText", plan.frame.in_metres().crs_line, None),
        ("Easting", "IfcLengthMeasure", east_m, target.metre),
        ("Northing", "IfcLengthMeasure", north_m, target.metre),
        ("GroundHeight", "IfcLengthMeasure", float(station.site_ground_m[2]), target.metre),
        ("InstrumentHeight", "IfcLengthMeasure", station.instrument_height_m, target.metre),
        ("SensorHeight", "IfcLengthMeasure", sensor_m, target.metre),
        ("CoveredArea", "IfcAreaMeasure", station.covered_area_m2, target.square_metre),
        ("OwnArea", "IfcAreaMeasure", station.own_area_m2, target.square_metre),
        # What is not known to be seen is not known to overlap.
        *([] if math.isnan(station.covered_area_m2) else [("LinkedTo", "IfcText", _linked(plan, station), None)]),
    ]
    properties = []
    for name, kind, value, unit in rows:
        if isinstance(value, float):
            if not math.isfinite(value):
                continue
            value = round(value, _DECIMALS)
        wrapped = target.model.create_entity(kind, value)
        properties.append(target.model.create_entity("IfcPropertySingleValue", name, None, wrapped, unit))
    pset = target.rooted("IfcPropertySet", f"station/{station.id}", Name=PSET, HasProperties=properties)
    target.relate(
        "IfcRelDefinesByProperties",
        f"station/{station.id}",
        RelatedObjects=[proxy],
        RelatingPropertyDefinition=pset,
    )


def _linked(plan: PlanSource, station: FieldStation) -> str:
    """`S002 99.3 %, S004 99.9 %`: stations whose scans register with this one's, and what decides it."""
    linked = [
        f"{link.b if link.a == station.id else link.a} {plan.link_percent(link)} %"
        for link in plan.links
        if plan.counts(link) and station.id in (link.a, link.b)
    ]
    return ", ".join(linked) or "none"


# ---------------------------------------------------------------------------------------------- a new file
def _new_project(target: _Target, plan: PlanSource) -> tuple[Any, Any]:
    """Create project, contexts, units, site and building; return the context of bodies, and the building."""
    create = target.model.create_entity
    angle = create("IfcSIUnit", None, "PLANEANGLEUNIT", None, "RADIAN")
    volume = create("IfcSIUnit", None, "VOLUMEUNIT", None, "CUBIC_METRE")
    units = create("IfcUnitAssignment", [target.metre, target.square_metre, volume, angle])
    origin = create("IfcAxis2Placement3D", target.point(np.zeros(3)))
    context = create("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, origin)
    body = create(
        "IfcGeometricRepresentationSubContext",
        ContextIdentifier="Body",
        ContextType="Model",
        ParentContext=context,
        TargetView="MODEL_VIEW",
    )
    project = target.rooted(
        "IfcProject", "project", Name=f"Stations of {plan.title}", RepresentationContexts=[context],
        UnitsInContext=units,
    )  # fmt: skip
    site = target.rooted("IfcSite", "site", Name="Site", CompositionType="ELEMENT")
    site.ObjectPlacement = target.placement(np.zeros(3), None)
    building = target.rooted("IfcBuilding", "building", Name=plan.title, CompositionType="ELEMENT")
    building.ObjectPlacement = target.placement(np.zeros(3), site.ObjectPlacement)
    target.relate("IfcRelAggregates", "site", RelatingObject=project, RelatedObjects=[site])
    target.relate("IfcRelAggregates", "building", RelatingObject=site, RelatedObjects=[building])
    return body, building


def _new_storey(target: _Target, name: str, floor_id: str, elevation_m: float, parent: Any) -> Any:
    return target.rooted(
        "IfcBuildingStorey",
        f"floor/{floor_id}",
        Name=name,
        ObjectPlacement=target.placement(np.array([0.0, 0.0, elevation_m]), parent),
        CompositionType="ELEMENT",
        Elevation=round(elevation_m, _DECIMALS),
    )


def _place_on_map(target: _Target, frame: SiteFrame, context: Any) -> tuple[str, ...]:
    """Say where the model is on the site's grid; what IFC can't say becomes a remark."""
    if frame.is_scene:
        return ()
    matrix, scale = frame.matrix, frame.horizontal_scale
    turn = math.atan2(float(matrix[1, 0]), float(matrix[0, 0]))
    cos, sin = scale * math.cos(turn), scale * math.sin(turn)
    upwards = float(matrix[2, 2])
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, upwards]])
    if np.abs(matrix[:3, :3] - turned).max() > _SAME_SCALE:
        return ("IFC has no tilted or skewed grid: only the stations' properties hold site coordinates",)
    # The CRS is named, so that eastings are in its unit, whatever other files of the plan are in.
    unit = frame.crs_unit
    system = target.model.create_entity(
        "IfcProjectedCRS",
        Name=frame.crs if frame.crs.upper().startswith("EPSG:") else frame.name,
        Description=replace(frame, unit=unit).crs_line,
        VerticalDatum=frame.vertical_crs or None,
        MapUnit=_map_unit(target, unit),
    )
    east, north, height = unit.of_array(matrix[:3, 3]).tolist()
    target.model.create_entity(
        "IfcMapConversion",
        SourceCRS=context,
        TargetCRS=system,
        Eastings=east,
        Northings=north,
        OrthogonalHeight=height,
        XAxisAbscissa=math.cos(turn),
        XAxisOrdinate=math.sin(turn),
        Scale=round(unit.of(scale), 12),
    )
    if abs(scale - upwards) > _SAME_SCALE:
        return (f"IFC's map conversion scales heights, too, by {scale:.6f}: the stations' properties hold true ones",)
    return ()


def _map_unit(target: _Target, unit: LengthUnit) -> Any:
    """Return the unit of eastings as an entity: the metre, or a foot by its factor to the metre."""
    if not unit.is_feet:
        return target.metre
    create = target.model.create_entity
    factor = create("IfcMeasureWithUnit", create("IfcRatioMeasure", unit.metres), target.metre)
    name = "US SURVEY FOOT" if unit is US_SURVEY_FOOT else "FOOT"
    lengths = create("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
    return create("IfcConversionBasedUnit", lengths, "LENGTHUNIT", name, factor)


# ------------------------------------------------------------------------------------------- the plan's own
def _source_model(plan: PlanSource) -> Any:
    scene = plan.document["scene"]
    if scene["format"] != "ifc":
        raise ExportError(
            f"{plan.title}: is {scene['format']}, expected an IFC file that stations can be put into; use format ifc"
        )
    if scene["up_axis"] != "Z":
        raise ExportError(f"{plan.title}: was read with {scene['up_axis']} up, expected z up; use format ifc")
    path = plan.scene_paths()[0]  # whose frame is the plan's
    try:
        return open_tried(path)
    except (OSError, SceneError) as error:
        raise ExportError(f"{path}: can't be read as IFC ({error}), expected the file that was planned on") from error


def _body_context(model: Any) -> Any:
    """Return the context that bodies are modelled in: the one called so, else any for 3D models."""
    below = model.by_type("IfcGeometricRepresentationSubContext")
    whole = [each for each in model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)
             if each.ContextType == "Model"]  # fmt: skip
    bodies = [each for each in below if each.ContextIdentifier == "Body" and each.ContextType in (None, "Model")]
    return next(iter([*bodies, *whole, *model.by_type("IfcGeometricRepresentationContext")]), None)


def _storey_of(model: Any, target: _Target, name: str, elevation_m: float) -> Any:
    """Return the storey of the floor's name, else the nearest in height; None where none is near."""
    heights = {}
    for storey in model.by_type("IfcBuildingStorey"):
        matrix = ifcopenshell.util.placement.get_local_placement(storey.ObjectPlacement)
        heights[storey] = abs(float(matrix[2, 3]) * target.metres_per_unit - elevation_m)
    named = [storey for storey in heights if storey.Name == name]
    near = sorted(named or heights, key=lambda storey: (heights[storey], storey.id()))
    return near[0] if near and (named or heights[near[0]] <= _SAME_HEIGHT_M) else None
