"""Rooms: read from IFC, and what lies in them; closed shapes against Open3D's occupancy."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.model import Room, Storey
from planner_core.scene.doors import exterior_doors
from planner_core.scene.inside import enclosures
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.rooms import room_of_points, room_of_surfaces, with_rooms
from tests.scene.floor_scenes import four_walls, scene_of

FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
     [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]]
)  # fmt: skip


def box(low, high):
    unit = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    return np.asarray(low) + unit * (np.asarray(high, dtype=np.float64) - np.asarray(low))


def rooms(*boxes):
    made = (Room(f"R{i}", "", "", -1, box(*ends), FACES.astype(np.int32)) for i, ends in enumerate(boxes))
    return SimpleNamespace(rooms=tuple(made))


def test_enclosures_are_those_of_open3d_for_tilted_shapes_of_any_winding():
    import open3d

    rng = np.random.default_rng(5)
    points_m = rng.uniform(-2, 2, (800, 3))
    corners, owner, expected = [], [], set()
    for shape in range(6):
        hull = open3d.geometry.TriangleMesh.create_torus(rng.uniform(0.6, 1.2), rng.uniform(0.2, 0.5), 12, 8)
        hull.rotate(open3d.geometry.get_rotation_matrix_from_xyz(rng.uniform(0, 3, 3)))
        hull.translate(rng.uniform(-1, 1, 3))
        caster = open3d.t.geometry.RaycastingScene()
        caster.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(hull))
        inside = caster.compute_occupancy(open3d.core.Tensor(points_m.astype(np.float32)), nsamples=5).numpy() > 0.5
        expected |= {(int(p), shape) for p in np.flatnonzero(inside)}
        triangles = np.asarray(hull.triangles).copy()
        turned = rng.random(len(triangles)) < 0.5
        triangles[turned] = triangles[turned][:, ::-1]
        corners.append(np.asarray(hull.vertices)[triangles])
        owner.append(np.full(len(triangles), shape))
    found = enclosures(points_m, np.concatenate(corners), np.concatenate(owner))
    got = set(zip(found.point.tolist(), found.shape.tolist(), strict=True))
    assert expected
    assert got == expected


def test_points_are_in_the_smallest_room_around_them():
    scene = rooms(((0, 0, 0), (9, 9, 3)), ((1, 1, 0), (3, 3, 2.5)))
    points_m = np.array([[2, 2, 1], [5, 5, 1], [2, 2, 2.8], [2, 2, 5], [-1, 2, 1], [2, 2, -0.5]])
    assert room_of_points(scene, points_m).tolist() == [1, 0, 0, -1, -1, -1]


def test_surface_of_a_wall_belongs_to_the_room_in_front_of_it():
    scene = rooms(((0, 0, 0), (4, 3, 2.5)), ((4.2, 0, 0), (8, 3, 2.5)))
    at = np.array([[4.0, 1, 1], [4.2, 1, 1], [4.0, 1, 1], [8.0, 1, 1]])
    normal = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]])
    assert room_of_surfaces(scene, at, normal).tolist() == [0, 1, 0, 1]  # the last two from behind


def test_scene_without_rooms_has_everything_in_none():
    assert room_of_points(SimpleNamespace(rooms=()), np.zeros((2, 3))).tolist() == [-1, -1]


@pytest.fixture
def written(tmp_path):
    """An IFC file with three spaces, one without a shape and one flat as a plan symbol; far from its origin."""
    from ifcopenshell.api import aggregate, geometry, project, root, spatial, unit
    from ifcopenshell.api import context as contexts

    model = project.create_file(version="IFC4")
    building = root.create_entity(model, ifc_class="IfcProject", name="P")
    unit.assign_unit(model, length={"is_metric": True, "raw": "MILLIMETERS"})
    context = contexts.add_context(model, context_type="Model")
    body = contexts.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context
    )
    storeys = [root.create_entity(model, ifc_class="IfcBuildingStorey", name=name) for name in ("Upper", "Ground")]
    aggregate.assign_object(model, products=storeys, relating_object=building)

    def add(kind, name, low, high, storey, long_name=None):
        product = root.create_entity(model, ifc_class=kind, name=name)
        if low is not None:
            faces = [list(face) for face in FACES.tolist()]
            shape = geometry.add_mesh_representation(
                model, context=body, vertices=[box(low, high).tolist()], faces=[faces]
            )
            geometry.assign_representation(model, product=product, representation=shape)
        at = np.eye(4)
        at[:3, 3] = (100_000.0, 200_000.0, 0.0)
        geometry.edit_object_placement(model, product=product, matrix=at)
        if kind == "IfcSpace":
            product.LongName = long_name
            aggregate.assign_object(model, products=[product], relating_object=storeys[storey])
        else:
            spatial.assign_container(model, products=[product], relating_structure=storeys[storey])

    for storey, z in ((0, 3.0), (1, 0.0)):
        placed = np.eye(4)
        placed[2, 3] = z
        geometry.edit_object_placement(model, product=storeys[storey], matrix=placed)
    add("IfcSlab", "Slab", (0, 0, -0.2), (6, 4, 0), 1)
    add("IfcSpace", "001", (0, 0, 0), (6, 4, 2.5), 1, "Hall")
    add("IfcSpace", "002", None, None, 1)
    add("IfcSpace", "003", (0, 0, 0), (6, 4, 0.01), 1)
    add("IfcSpace", "101", (0, 0, 3), (6, 4, 5.5), 0)
    path = tmp_path / "rooms.ifc"
    model.write(str(path))
    return path


def test_spaces_become_rooms_and_no_surface_and_odd_ones_are_told(written):
    scene = load_scene(written)
    assert [element.name for element in scene.elements] == ["Slab"]
    assert [(r.title, scene.storeys[r.storey].name) for r in scene.rooms] == [("001 Hall", "Ground"), ("101", "Upper")]
    assert all(len(room.source_id) == 22 for room in scene.rooms)
    low, high = scene.rooms[0].box_m + scene.offset_m
    assert low == pytest.approx([100_000, 200_000, 0], abs=1e-6)
    assert high == pytest.approx([100_006, 200_004, 2.5], abs=1e-6)
    assert scene.offset_m.any()
    (line,) = [w for w in scene.report.warnings if "usable shape" in w]
    assert "003" in line
    middle = np.array([[100_003.0, 200_002.0, z] for z in (1.0, 4.0, 9.0)]) - scene.offset_m
    assert room_of_points(scene, middle).tolist() == [0, 1, -1]


def test_rooms_turn_with_the_building_and_take_its_unit(written):
    scene = load_scene(written, options=LoadOptions(metres_per_unit=0.01, up_axis="Y"))
    room, slab = scene.rooms[0].box_m, scene.vertices_m
    assert np.ptp(room, axis=0) == pytest.approx([60, 25, 40])
    assert room[0, 0] == pytest.approx(slab[:, 0].min())
    assert room[:, 2] == pytest.approx([slab[:, 2].min(), slab[:, 2].max()])


@pytest.mark.slow
def test_rooms_of_the_duplex_hold_their_floors(real_scene):
    scene = real_scene("duplex")
    assert len(scene.rooms) == 21
    assert {"A102 Living Room", "B201 Hallway", "A104 Bathroom 1"} <= {room.title for room in scene.rooms}
    for room in scene.rooms:
        low, high = room.box_m
        if room.long_name in ("Bathroom 1", "Bathroom 2", "Utility", "Bedroom 1"):  # these are convex
            middle = 0.5 * (low + high)
            assert scene.rooms[room_of_points(scene, middle[None])[0]].title == room.title


STOREY_M = 2.8


def building(*, room_low, room_aside=0.0, storey_of_room=0, roof_m=6.0, doors=True, n_storeys=2, unit_m=1.0):
    """Walls of storeys of 2.8 m below a roof, a door in each, and rooms with their feet `room_low`, in metres."""
    storeys = [Storey(f"S{i}", f"S{i}", STOREY_M * i) for i in range(n_storeys)]
    parts = [("roof", "IfcRoof", -1, (0, 0, roof_m - 0.2), (8, 6, roof_m))]
    for i in range(n_storeys):
        parts += four_walls(8, 6, STOREY_M * i, STOREY_M * (i + 1), i)
        parts.append((f"slab {i}", "IfcSlab", i, (0, 0, STOREY_M * i - 0.2), (8, 6, STOREY_M * i)))
        if doors:
            parts.append((f"door {i}", "IfcDoor", i, (3, 0, STOREY_M * i), (4, 0.2, STOREY_M * i + 2.1)))
    scene = scene_of(parts, [(s.name, s.elevation_m) for s in storeys])
    given = tuple(
        Room(f"R{i}", "", f"R{i}", i + storey_of_room,
             box((0.2 + room_aside, 0.2, z), (7.8 + room_aside, 5.8, z + 2.5)) / unit_m, FACES.astype(np.int32))
        for i, z in enumerate(room_low)
    )  # fmt: skip
    return with_rooms(scene, given, tuple(storeys), metres_per_unit=unit_m, up_axis="Z")


@pytest.mark.parametrize(
    "off",
    [
        pytest.param({"room_low": (2.8, 5.6)}, id="above the roof"),
        pytest.param({"room_low": (2.8, 5.6), "roof_m": 9.0}, id="in an attic"),
        pytest.param({"room_low": (-2.8, 0.0)}, id="below the ground"),
        pytest.param({"room_low": (2.8,), "n_storeys": 1, "roof_m": 3.0, "doors": False}, id="a storey, no doors"),
        pytest.param({"room_low": (2.8, 5.6), "unit_m": 0.001}, id="in millimetres"),
    ],
)
def test_rooms_a_storey_off_are_taken_back_to_their_storeys_with_a_warning(off):
    scene = building(**off)
    feet_m = [float(room.box_m[0, 2]) for room in scene.rooms]
    assert feet_m == pytest.approx([STOREY_M * i for i in range(len(feet_m))])
    (line,) = [line for line in scene.report.warnings if "rooms" in line]
    assert "2.80 m above" in line or "2.80 m below" in line
    if off.get("doors", True):
        doors = [number for number, element in enumerate(scene.elements) if element.kind == "IfcDoor"]
        assert [door.element for door in exterior_doors(scene)] == doors


@pytest.mark.parametrize(
    "right",
    [
        pytest.param({"room_low": (0.0, 2.8)}, id="on their storeys"),
        pytest.param({"room_low": (0.15, 2.95)}, id="on a screed"),
        pytest.param({"room_low": (0.0,), "storey_of_room": 1}, id="a wrong storey"),
        pytest.param({"room_low": (0.0, 0.0)}, id="one of two off"),
    ],
)
def test_rooms_that_doors_lead_to_stay_where_they_are(right):
    scene = building(**right)
    assert [float(room.box_m[0, 2]) for room in scene.rooms] == pytest.approx(list(right["room_low"]))
    assert not [line for line in scene.report.warnings if "rooms" in line]


@pytest.mark.parametrize(
    ("aside_m", "is_doubted"), [(0.0, False), (0.9, False), (3.0, True), (-3.0, True), (60.0, True)]
)
@pytest.mark.parametrize("unit_m", [1.0, 0.001])
def test_rooms_beside_the_building_are_doubted(aside_m, is_doubted, unit_m):
    scene = building(room_low=(0.0, 2.8), room_aside=aside_m, unit_m=unit_m)
    lines = [line for line in scene.report.warnings if "beyond all surfaces" in line]
    assert len(lines) == is_doubted
    assert all(
        f"2 of its 2 rooms (IfcSpace) reach beyond all surfaces, R0 by {abs(aside_m) - 0.2:.1f} m" in x for x in lines
    )
