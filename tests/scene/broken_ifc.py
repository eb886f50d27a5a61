"""Ways to break an IFC file that ended the process, or hung it, when IfcOpenShell was asked for its shapes.

Each is a change of the text of a sound file (`write_building`'s), found in a campaign of random changes and made small.
"""

from __future__ import annotations

import re
from collections.abc import Callable


def instance(text: str, ifc_class: str, at: int = 0) -> str:
    """Number (`#12`) of an instance, the first of its class unless told."""
    return re.findall(rf"(#\d+)={ifc_class.upper()}\(", text)[at]


def slots(text: str, number: str) -> list[str]:
    """Attributes of an instance, as they are written."""
    (inner,) = re.findall(rf"^{number}=\w+\((.*)\);$", text, re.MULTILINE)
    return re.findall(r"(?:'[^']*'|\([^()]*\)|[^,'()])+", inner)


def changed(text: str, number: str, slot: int, value: str) -> str:
    """The text with one attribute of an instance replaced."""
    parts = slots(text, number)
    parts[slot] = value
    return re.sub(rf"^({number}=\w+)\(.*\);$", lambda m: f"{m.group(1)}({','.join(parts)});", text, flags=re.MULTILINE)


def extended(text: str, lines: list[str]) -> str:
    """The text with further instances."""
    return text.replace("ENDSEC;\nEND-ISO", "\n".join(lines) + "\nENDSEC;\nEND-ISO")


def next_number(text: str) -> int:
    return max(map(int, re.findall(r"^#(\d+)=", text, re.MULTILINE))) + 1


def bad_id(ifc_class: str, value: str) -> Callable[[str], str]:
    return lambda text: changed(text, instance(text, ifc_class), 0, value)


def placed_in_itself(text: str) -> str:
    placement = slots(text, instance(text, "IfcWall"))[5]
    return changed(text, placement, 0, placement)


def placed_in_a_circle(text: str) -> str:
    placement = slots(text, instance(text, "IfcWall"))[5]
    return changed(text, slots(text, placement)[0], 0, placement)


def chained_placements(n: int) -> Callable[[str], str]:
    def change(text: str) -> str:
        wall, first = instance(text, "IfcWall"), next_number(text)
        above, axes = slots(text, slots(text, wall)[5])
        above_each = [above, *(f"#{first + i}" for i in range(n - 1))]
        lines = [f"#{first + i}=IFCLOCALPLACEMENT({above_each[i]},{axes});" for i in range(n)]
        return changed(extended(text, lines), wall, 5, f"#{first + n - 1}")

    return change


def mapped_in_itself(text: str) -> str:
    item = instance(text, "IfcMappedItem")
    mapped = slots(text, slots(text, item)[0])[1]
    return changed(text, mapped, 3, f"({item})")


def mapped_in_each_other(depth: int, fan: int) -> Callable[[str], str]:
    def change(text: str) -> str:
        item, number = instance(text, "IfcMappedItem"), next_number(text)
        source, target = slots(text, item)
        origin, mapped = slots(text, source)
        context, lines = slots(text, mapped)[0], []
        for _ in range(depth):
            items = ",".join([f"#{number}"] * fan)
            lines += [
                f"#{number}=IFCMAPPEDITEM({source},{target});",
                f"#{number + 1}=IFCSHAPEREPRESENTATION({context},'Body','MappedRepresentation',({items}));",
                f"#{number + 2}=IFCREPRESENTATIONMAP({origin},#{number + 1});",
            ]
            source, number = f"#{number + 2}", number + 3
        return changed(extended(text, lines), item, 0, source)

    return change


def cut_from_itself(text: str) -> str:
    number = next_number(text)
    return _wall_cut(text, [number], [number])


def chained_cuts(n: int) -> Callable[[str], str]:
    def change(text: str) -> str:
        numbers = [*range(next_number(text), next_number(text) + n)]
        solid = int(slots(text, _body(text, "IfcWall"))[3].strip("(#)"))
        return _wall_cut(text, numbers, [solid, *numbers[:-1]])

    return change


def _body(text: str, ifc_class: str) -> str:
    return slots(text, slots(text, instance(text, ifc_class))[6])[2].strip("()")


def _wall_cut(text: str, numbers: list[int], from_what: list[int]) -> str:
    """The text with boolean results from which the opening's solid is taken, the last of them the wall's shape."""
    (opening,) = slots(text, _body(text, "IfcOpeningElement"))[3].strip("()").split(",")
    cuts = zip(numbers, from_what, strict=True)
    lines = [f"#{number}=IFCBOOLEANRESULT(.DIFFERENCE.,#{whole},{opening});" for number, whole in cuts]
    return changed(extended(text, lines), _body(text, "IfcWall"), 3, f"(#{numbers[-1]})")


def opening_is(ifc_class: str) -> Callable[[str], str]:
    return lambda text: changed(text, instance(text, "IfcRelVoidsElement"), 5, instance(text, ifc_class))


def whole_is_its_part(text: str) -> str:
    """Each aggregate, and none knows of a building."""
    for relation in re.findall(r"(#\d+)=IFCRELAGGREGATES\(", text):
        text = changed(text, relation, 5, f"({slots(text, relation)[4]})")
    return text


def storey_names_a_point(slot: int) -> Callable[[str], str]:
    return lambda text: changed(text, instance(text, "IfcBuildingStorey"), slot, instance(text, "IfcCartesianPoint"))


def without_location(ifc_class: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        placement = slots(text, instance(text, ifc_class))[5]
        return changed(text, slots(text, placement)[1], 0, "$")

    return change


def unit(slot: int, value: str) -> Callable[[str], str]:
    return lambda text: changed(text, instance(text, "IfcSIUnit"), slot, value)


REFUSED: dict[str, tuple[Callable[[str], str], str]] = {
    **{
        f"GlobalId {value} of {ifc_class}": (
            bad_id(ifc_class, value),
            rf"the GlobalId of #\d+ \({ifc_class.upper()}\) is .*expected a text of 22 characters",
        )
        for ifc_class, values in (
            ("IfcWall", ("$", "*", "7", ".A.", "#1", "('a')")),
            ("IfcSlab", ("$",)),
            ("IfcFurnishingElement", ("*",)),
            ("IfcSpace", ("7",)),
        )
        for value in values
    },
    "placement in itself": (placed_in_itself, r"#\d+ \(IFCLOCALPLACEMENT\) is made of itself"),
    "placements in a circle": (placed_in_a_circle, r"#\d+ \(IFCLOCALPLACEMENT\) is made of itself"),
    "20 000 placements": (
        chained_placements(20_000),
        r"#\d+ \(IFCWALL\) stands on a chain of more than 2 000 instances",
    ),
    "mapped in itself": (mapped_in_itself, r"#\d+ \(IFC\w+\) is made of itself"),
    "mapped in each other": (mapped_in_each_other(9, 10), r"#\d+ \(IFCFURNISHINGELEMENT\) has \de\+\d+ parts placed"),
    "cut from itself": (cut_from_itself, r"#\d+ \(IFCBOOLEANRESULT\) is made of itself"),
    "20 000 cuts": (chained_cuts(20_000), "stands on a chain of more than 2 000 instances"),
    "opening is a direction": (opening_is("IfcDirection"), r"\(IfcRelVoidsElement\) cuts #\d+ \(IfcDirection\)"),
    "opening is a wall": (opening_is("IfcWall"), r"\(IfcRelVoidsElement\) cuts #\d+ \(IfcWall\) out of an element"),
    "storey placed by a point": (storey_names_a_point(5), "do not follow IFC4"),
    "storey shaped by a point": (storey_names_a_point(6), "do not follow IFC4"),
    **{
        f"{ifc_class} lies nowhere": (
            without_location(ifc_class),
            r"#\d+ \(IFCAXIS2PLACEMENT3D\) lacks Location, which its schema requires",
        )
        for ifc_class in ("IfcOpeningElement", "IfcWall", "IfcBuildingStorey")
    },
    "unit of 1e18 metres": (unit(2, ".EXA."), r"its length unit #\d+ is 1e\+18 m long"),
    "unknown unit": (unit(3, ".EXA."), r"its length unit #\d+ is none that IFC has, expected METRE"),
}
"""By name, the change, and what the line says."""

READ: dict[str, Callable[[str], str]] = {
    "wholes are their own parts": whole_is_its_part,
    "200 placements": chained_placements(200),
    "mapped in each other, a little": mapped_in_each_other(3, 2),
    "20 cuts": chained_cuts(20),
    "GlobalId of an opening": bad_id("IfcOpeningElement", "$"),
}
