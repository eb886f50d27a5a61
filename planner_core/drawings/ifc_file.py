"""A lifted building as IFC4, in metres: storeys, walls with openings, doors, windows, slabs and rooms, all extruded.

People keep the file and mend it in a BIM editor; planning reads it as any other. Elements that the drawing does not
show for certain have the property `Doubtful` in the set `TLSPLAN_Drawing`. Ids follow from names (RFC 4122, version 5),
the header has no time: same building, same bytes.

Source: buildingSMART, IFC4 ADD2 TC1.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import shapely

from planner_core.drawings.building import Building, BuildingElement, BuildingRoom, BuildingStorey, Prism
from planner_core.errors import MissingPackageError

PSET = "TLSPLAN_Drawing"
GLASS = "Glass"
"""The material of panes, by which readers know that beams go through."""
_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_OID, "tlsplan drawings")
_TIME = "2000-01-01T00:00:00"
_DECIMALS = 5
"""Coordinates are rounded to 0.01 mm."""
_PSET_OF = {"IfcDoor": "Pset_DoorCommon", "IfcWindow": "Pset_WindowCommon"}


def write_building(building: Building, path: Path) -> None:
    """Write a building to `path`.

    Raises
    ------
    MissingPackageError
        IfcOpenShell is not installed.
    OSError
        The file can't be written.
    """
    try:
        import ifcopenshell
    except ImportError as error:
        raise MissingPackageError(
            "a drawing is lifted to IFC by the package ifcopenshell, which is missing; run pip install ifcopenshell."
        ) from error
    writer = _Writer(ifcopenshell.file(schema="IFC4"), building.name)
    writer.write(building)
    header = writer.model.header
    header.file_description.description = ("ViewDefinition [ReferenceView]",)
    header.file_name.name, header.file_name.time_stamp = f"{building.name}.ifc", _TIME
    header.file_name.author, header.file_name.organization = ("",), ("",)
    header.file_name.preprocessor_version = header.file_name.originating_system = "tlsplan"
    header.file_name.authorization = ""
    writer.model.write(str(path), format=".ifc")


class _Writer:
    """The model being written."""

    def __init__(self, model: Any, name: str) -> None:
        self.model = model
        self._name = name
        self._n_of: dict[str, int] = {}
        self._up = model.create_entity("IfcDirection", (0.0, 0.0, 1.0))
        self._origin = model.create_entity("IfcAxis2Placement3D", self._point(0.0, 0.0, 0.0))
        self._glass: list[Any] = []

    def write(self, building: Building) -> None:
        units = [
            self.model.create_entity("IfcSIUnit", None, kind, None, name)
            for kind, name in (
                ("LENGTHUNIT", "METRE"),
                ("AREAUNIT", "SQUARE_METRE"),
                ("VOLUMEUNIT", "CUBIC_METRE"),
                ("PLANEANGLEUNIT", "RADIAN"),
            )
        ]
        context = self.model.create_entity(
            "IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, self._origin, self._north(building.north_deg)
        )
        self._body = self.model.create_entity(
            "IfcGeometricRepresentationSubContext", "Body", "Model",
            ParentContext=context, TargetView="MODEL_VIEW",
        )  # fmt: skip
        project = self._rooted("IfcProject", building.name)
        project.RepresentationContexts = (context,)
        project.UnitsInContext = self.model.create_entity("IfcUnitAssignment", units)
        site = self._rooted("IfcSite", "Site", ObjectPlacement=self._placement(None, 0.0))
        house = self._rooted("IfcBuilding", building.name, ObjectPlacement=self._placement(site.ObjectPlacement, 0.0))
        storeys = [self._storey(storey, house.ObjectPlacement) for storey in building.storeys]
        self._aggregate("project", project, [site])
        self._aggregate("site", site, [house])
        self._aggregate("building", house, storeys)
        if self._glass:
            material = self.model.create_entity("IfcMaterial", GLASS, None, GLASS)
            self._rooted("IfcRelAssociatesMaterial", GLASS, RelatedObjects=self._glass, RelatingMaterial=material)

    def _storey(self, storey: BuildingStorey, under: Any) -> Any:
        placement = self._placement(under, storey.elevation_m)
        entity = self._rooted("IfcBuildingStorey", storey.name, ObjectPlacement=placement)
        entity.Elevation = round(storey.elevation_m, _DECIMALS)
        made = {each.name: self._element(each, placement, storey.name) for each in storey.elements}
        if made:
            self._rooted(
                "IfcRelContainedInSpatialStructure", storey.name,
                RelatedElements=list(made.values()), RelatingStructure=entity,
            )  # fmt: skip
        for each in storey.elements:
            if each.opening is not None:
                self._cut(made[each.name], each.opening, made.get(each.filled_by), placement, storey.name)
        spaces = [self._space(room, placement, storey.name) for room in storey.rooms]
        if spaces:
            self._aggregate(f"{storey.name} rooms", entity, spaces)
        return entity

    def _element(self, element: BuildingElement, under: Any, storey: str) -> Any:
        entity = self._rooted(element.kind, element.name, key=f"{storey}/{element.name}")
        entity.ObjectPlacement = self._placement(under, 0.0)
        entity.Representation = self._shape(element.prisms)
        if element.predefined_type:
            entity.PredefinedType = element.predefined_type
        if element.kind in _PSET_OF:
            low, high = min(p.low_m for p in element.prisms), max(p.high_m for p in element.prisms)
            entity.OverallHeight = round(high - low, _DECIMALS)
        if any(prism.is_glass for prism in element.prisms):
            self._glass.append(entity)
        if element.is_external is not None and element.kind in _PSET_OF:
            self._property(entity, _PSET_OF[element.kind], "IsExternal", element.is_external, storey)
        if element.is_doubtful:
            self._property(entity, PSET, "Doubtful", True, storey)
        return entity

    def _cut(self, wall: Any, hole: Prism, filling: Any, under: Any, storey: str) -> None:
        key = f"{storey}/{wall.Name}"
        opening = self._rooted("IfcOpeningElement", f"Opening of {wall.Name}", key=key)
        opening.PredefinedType = "OPENING"
        opening.ObjectPlacement = self._placement(under, 0.0)
        opening.Representation = self._shape((hole,))
        self._rooted("IfcRelVoidsElement", None, key=key, RelatingBuildingElement=wall, RelatedOpeningElement=opening)
        if filling is not None:
            self._rooted(
                "IfcRelFillsElement", None, key=key, RelatingOpeningElement=opening, RelatedBuildingElement=filling
            )

    def _space(self, room: BuildingRoom, under: Any, storey: str) -> Any:
        space = self._rooted("IfcSpace", room.name, key=f"{storey}/{room.name}")
        space.LongName = room.long_name or None
        space.PredefinedType = "INTERNAL"
        space.ObjectPlacement = self._placement(under, 0.0)
        space.Representation = self._shape((Prism(room.area, 0.0, room.height_m),))
        return space

    # ------------------------------------------------------------------------------------- parts
    def _rooted(self, ifc_class: str, name: str | None, *, key: str = "", **attributes: Any) -> Any:
        key = f"{self._name}/{ifc_class}/{key or name}"
        self._n_of[key] = self._n_of.get(key, 0) + 1
        import ifcopenshell.guid

        number = ifcopenshell.guid.compress(uuid.uuid5(_NAMESPACE, f"{key}/{self._n_of[key]}").hex)
        return self.model.create_entity(ifc_class, GlobalId=number, Name=name, **attributes)

    def _aggregate(self, name: str, whole: Any, parts: Sequence[Any]) -> None:
        self._rooted("IfcRelAggregates", name, RelatingObject=whole, RelatedObjects=list(parts))

    def _property(self, entity: Any, set_name: str, name: str, value: bool, storey: str) -> None:
        nominal = self.model.create_entity("IfcBoolean", value)
        single = self.model.create_entity("IfcPropertySingleValue", name, None, nominal)
        key = f"{storey}/{entity.Name}/{set_name}"
        pset = self._rooted("IfcPropertySet", set_name, key=key, HasProperties=[single])
        self._rooted(
            "IfcRelDefinesByProperties", None, key=key, RelatedObjects=[entity], RelatingPropertyDefinition=pset
        )

    def _point(self, *values: float) -> Any:
        return self.model.create_entity("IfcCartesianPoint", tuple(round(float(v), _DECIMALS) + 0.0 for v in values))

    def _north(self, north_deg: float | None) -> Any:
        """Direction of north in the plan."""
        if north_deg is None:
            return None
        turn = math.radians(north_deg)
        return self.model.create_entity("IfcDirection", (round(math.sin(turn), 9), round(math.cos(turn), 9)))

    def _placement(self, under: Any, height_m: float) -> Any:
        at = self.model.create_entity("IfcAxis2Placement3D", self._point(0.0, 0.0, height_m))
        return self.model.create_entity("IfcLocalPlacement", under, at)

    def _shape(self, prisms: Sequence[Prism]) -> Any:
        solids = [self._solid(prism) for prism in prisms]
        shape = self.model.create_entity("IfcShapeRepresentation", self._body, "Body", "SweptSolid", solids)
        return self.model.create_entity("IfcProductDefinitionShape", None, None, [shape])

    def _solid(self, prism: Prism) -> Any:
        area = shapely.orient_polygons(prism.area)
        outer, *holes = (self._ring(ring) for ring in (area.exterior, *area.interiors))
        if holes:
            profile = self.model.create_entity("IfcArbitraryProfileDefWithVoids", "AREA", None, outer, holes)
        else:
            profile = self.model.create_entity("IfcArbitraryClosedProfileDef", "AREA", None, outer)
        at = self.model.create_entity("IfcAxis2Placement3D", self._point(0.0, 0.0, prism.low_m))
        depth_m = round(prism.high_m - prism.low_m, _DECIMALS)
        return self.model.create_entity("IfcExtrudedAreaSolid", profile, at, self._up, depth_m)

    def _ring(self, ring: Any) -> Any:
        points = [self._point(x, y) for x, y in shapely.get_coordinates(ring)[:-1].tolist()]
        return self.model.create_entity("IfcPolyline", [*points, points[0]])
