"""The unit of length of an IFC file: which it names, and what its shapes are made in where it names none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import SceneError
from planner_core.scene.extent import LONGEST_M, check_size

#: Share of elements at either end of an axis that may lie far out of the building.
_FAR_OUT = 0.1
_SHORTEST_UNIT_M, _LONGEST_UNIT_M = 1e-9, 1e6


def length_unit(path: Path, model: Any, user_unit_m: float | None) -> tuple[float, str]:
    """Metres per unit, and its name; that of the user or 1, and empty, where the file names none.

    Raises
    ------
    SceneError
        A unit that is no length, of no length that buildings are drawn in, or units of two lengths.
    """
    from ifcopenshell.util import unit as units

    unit = units.get_project_unit(model, "LENGTHUNIT")
    if unit is None:
        return user_unit_m or 1.0, ""
    if unit.is_a("IfcSIUnit") and unit.Name != "METRE":
        raise SceneError(
            f"{path.name}: its length unit #{unit.id()} is {unit.Name or 'none that IFC has'}, expected METRE with or "
            "without a prefix, or a unit converted to it; repair it, or export the file again."
        )
    _check_one_length_unit(path, model)
    unit_m = float(units.get_unit_scale(unit))  # that of the model is a power where the unit stands there twice
    if not _SHORTEST_UNIT_M <= unit_m <= _LONGEST_UNIT_M:
        raise SceneError(
            f"{path.name}: its length unit #{unit.id()} is {unit_m:g} m long, expected one that buildings are drawn "
            "in, such as MILLI METRE; repair it, or export the file again."
        )
    return unit_m, str(units.get_full_unit_name(unit)).lower()


def _check_one_length_unit(path: Path, model: Any) -> None:
    """Refuse a project with units of two lengths: shapes are made in one, and storeys would be in the other."""
    from ifcopenshell.util import unit as units

    of_project = model.by_type("IfcProject")[0].UnitsInContext.Units
    lengths = [unit for unit in of_project if getattr(unit, "UnitType", None) == "LENGTHUNIT"]
    if len({float(units.get_unit_scale(unit)) for unit in lengths}) > 1:
        named = " and ".join(f"#{unit.id()} ({units.get_full_unit_name(unit)})" for unit in lengths[:2])
        raise SceneError(
            f"{path.name}: its project has {len(lengths)} units of length, {named}, expected one; take out the wrong "
            "one, or export the file again."
        )


def assume_unit(model: Any, unit_m: float) -> None:
    """Give a project without a unit of length one: IfcOpenShell makes no shapes of IFC2X3 without any units."""
    from ifcopenshell.util.unit import get_project_unit

    if get_project_unit(model, "LENGTHUNIT") is not None:
        return
    unit = model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
    if unit_m != 1.0:
        size = model.create_entity("IfcMeasureWithUnit", model.create_entity("IfcLengthMeasure", unit_m), unit)
        length = model.create_entity("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
        unit = model.create_entity("IfcConversionBasedUnit", length, "LENGTHUNIT", "unit of the file", size)
    for project in model.by_type("IfcProject"):
        others = getattr(project.UnitsInContext, "Units", None) or ()
        project.UnitsInContext = model.create_entity("IfcUnitAssignment", Units=[*others, unit])


def check_spread(path: Path, products: list[Any]) -> None:
    """Refuse a file without a unit whose elements lie kilometres apart in metres: their shapes would take minutes.

    Raises
    ------
    SceneError
        With the unit that makes a building of it.
    """
    from ifcopenshell.util.placement import get_local_placement

    placed = [product.ObjectPlacement for product in products if product.ObjectPlacement is not None]
    if not placed:
        return
    places = np.array([get_local_placement(placement)[:3, 3] for placement in placed])
    low_m = np.quantile(places, _FAR_OUT, axis=0, method="higher")
    size_m = np.quantile(places, 1.0 - _FAR_OUT, axis=0, method="lower") - low_m
    if size_m.max() > LONGEST_M:
        check_size(f"{path.name}: read in metres its elements are placed over", size_m, 1.0)


def no_unit(path: Path, unit_name: str) -> str:
    """Return a line for the user where the file names no unit; empty where it does."""
    return "" if unit_name else f"{path.name} names no length unit: metres are assumed; pass --units if that is wrong."
