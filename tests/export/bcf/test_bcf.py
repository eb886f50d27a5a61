"""BCF, read back with zipfile, ElementTree and Pillow, and held against the XSDs of BCF 2.1 and IfcOpenShell's view."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import zipfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ifcopenshell
import ifcopenshell.geom
import numpy as np
import pytest
from PIL import Image

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import EnvironmentVariableError, PlanFolderError
from planner_core.export.options import Options
from planner_core.export.write import export_plan
from planner_core.model import FloatArray
from planner_core.review.changes import AddComment, AssignComment, Change, MoveStation, RemoveStation, ResolveComment
from planner_core.review.store import ReviewStore

GUID = r"[a-fA-F0-9]{8}-[a-fA-F0-9]{4}-[a-fA-F0-9]{4}-[a-fA-F0-9]{4}-[a-fA-F0-9]{12}"
IFC_GUID = r"[0-9,A-Za-z_$]{22}"
TIME = r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ"
NUMBER = r"-?\d+\.\d+"
POINT = ({}, {}, ["X", "Y", "Z"], ["X", "Y", "Z"])
WORDS = (r"(?s).*",)
Rule = tuple[dict[str, str], dict[str, str], list[str], list[str]]
#: Path of elements -> attributes that they must have, that they may have, their children in order, those that must be.
SCHEMA: dict[str, Rule] = {
    "Version": ({}, {"VersionId": r"2\.1"}, ["DetailedVersion"], []),
    "ProjectExtension": ({}, {}, ["Project", "ExtensionSchema"], ["ExtensionSchema"]),
    "Project": ({"ProjectId": ".+"}, {}, ["Name"], []),
    "Markup": ({}, {}, ["Header", "Topic", "Comment", "Viewpoints"], ["Topic"]),
    "Header": ({}, {}, ["File"], ["File"]),
    "File": ({}, {"isExternal": "true|false"}, ["Filename", "Date", "Reference"], []),
    "Topic": (
        {"Guid": GUID},
        {"TopicType": ".+", "TopicStatus": "Open|Resolved"},
        [
            "ReferenceLink",
            "Title",
            "Priority",
            "Index",
            "Labels",
            "CreationDate",
            "CreationAuthor",
            "DueDate",
            "AssignedTo",
            "Description",
            "DocumentReference",
        ],
        ["Title", "CreationDate", "CreationAuthor"],
    ),
    "DocumentReference": ({"Guid": GUID}, {"isExternal": "true|false"}, ["ReferencedDocument", "Description"], []),
    "Markup/Comment": ({"Guid": GUID}, {}, ["Date", "Author", "Comment", "Viewpoint"], ["Date", "Author", "Comment"]),
    "Comment/Viewpoint": ({"Guid": GUID}, {}, [], []),
    "Viewpoints": ({"Guid": GUID}, {}, ["Viewpoint", "Snapshot", "Index"], []),
    "VisualizationInfo": ({"Guid": GUID}, {}, ["Components", "OrthogonalCamera", "PerspectiveCamera"], []),
    "Components": ({}, {}, ["ViewSetupHints", "Selection", "Visibility", "Coloring"], ["Visibility"]),
    "Selection": ({}, {}, ["Component"], ["Component"]),
    "Component": ({}, {"IfcGuid": IFC_GUID}, ["OriginatingSystem", "AuthoringToolId"], []),
    "Visibility": ({}, {"DefaultVisibility": "true|false"}, ["Exceptions"], []),
    "PerspectiveCamera": (
        {},
        {},
        ["CameraViewPoint", "CameraDirection", "CameraUpVector", "FieldOfView"],
        ["CameraViewPoint", "CameraDirection", "CameraUpVector", "FieldOfView"],
    ),
    "CameraViewPoint": POINT,
    "CameraDirection": POINT,
    "CameraUpVector": POINT,
}
TEXTS = {
    "X": NUMBER, "Y": NUMBER, "Z": NUMBER, "FieldOfView": "4[5-9]|5[0-9]|60", "CreationDate": TIME, "Date": TIME,
    "Index": r"\d+", "ExtensionSchema": "",
}  # fmt: skip
ONCE = {"Labels", "File", "Component", "Comment", "Viewpoints"}
ANN, BEN = "Ann <ann@site.example>", "Ben"


def check(element: ElementTree.Element, parent: str = "") -> None:
    rule = SCHEMA.get(f"{parent}/{element.tag}") or SCHEMA.get(element.tag)
    if rule is None or (parent, element.tag) == ("Viewpoints", "Viewpoint"):
        assert not element.attrib and not len(element), element.tag
        assert re.fullmatch(TEXTS.get(element.tag, r"(?s).+"), element.text or ""), (element.tag, element.text)
        return
    required, allowed, children, needed = rule
    assert set(required) <= set(element.attrib) <= {*required, *allowed}, (element.tag, element.attrib)
    for name, value in element.attrib.items():
        assert re.fullmatch({**required, **allowed}[name], value), (element.tag, name, value)
    tags = [child.tag for child in element]
    assert [children.index(tag) for tag in tags] == sorted(children.index(tag) for tag in tags), element.tag
    assert set(needed) <= set(tags), element.tag
    assert all(tags.count(tag) == 1 for tag in set(tags) - ONCE), element.tag
    for child in element:
        check(child, element.tag)


@dataclass(frozen=True)
class Topic:
    """One folder of a BCF file."""

    guid: str
    markup: ElementTree.Element
    view: ElementTree.Element
    snapshot: bytes | None
    document: bytes | None = None

    def text(self, path: str) -> str:
        return self.markup.findtext(path) or ""

    @property
    def ifc_guids(self) -> list[str | None]:
        return [component.get("IfcGuid") for component in self.view.findall("Components/Selection/Component")]

    @property
    def ifc_guid(self) -> str | None:
        return next(iter(self.ifc_guids), None)

    def vector(self, name: str) -> FloatArray:
        return np.array([float(self.view.findtext(f"PerspectiveCamera/{name}/{axis}") or "nan") for axis in "XYZ"])

    def picture(self) -> Any:
        assert self.snapshot is not None
        return np.asarray(Image.open(io.BytesIO(self.snapshot)).convert("RGB"), dtype=np.int64)


def read(path: Path) -> list[Topic]:
    """Topics in their order; every file is checked against the schemas, and none is left over."""
    topics = []
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        files = {name: archive.read(name) for name in names}
    assert len(files) == len(names)
    for name in ("bcf.version", "project.bcfp"):
        check(ElementTree.fromstring(files.pop(name)))
    for folder in dict.fromkeys(name.split("/")[0] for name in files):
        markup = ElementTree.fromstring(files.pop(f"{folder}/markup.bcf"))
        check(markup)
        (row,) = markup.findall("Viewpoints")
        view = ElementTree.fromstring(files.pop(f"{folder}/{row.findtext('Viewpoint')}"))
        check(view)
        assert view.get("Guid") == row.get("Guid")
        assert markup.find("Topic").attrib["Guid"] == folder  # type: ignore[union-attr]
        snapshot = row.findtext("Snapshot")
        named = markup.findtext("Topic/DocumentReference/ReferencedDocument")
        pictures = [files.pop(f"{folder}/{name}") if name else None for name in (snapshot, named)]
        topics.append(Topic(folder, markup, view, *pictures))
    assert not files
    assert [topic.text("Topic/Index") for topic in topics] == [str(number) for number in range(len(topics))]
    return topics


def exported(folder: Path, name: str = "issues", **options: Any) -> tuple[list[Topic], tuple[str, ...]]:
    path = folder.parent / f"{name}.bcfzip"
    written = export_plan("bcf", folder, path, Options(**options), overwrite=True)
    return read(path), written.remarks


@pytest.fixture(scope="module")
def issues(planned_room: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Topic]:
    """Of the plan as it is, without a review."""
    path = tmp_path_factory.mktemp("issues") / "issues.bcfzip"
    assert export_plan("bcf", planned_room / "plan", path).remarks == ()
    return read(path)


def review(folder: Path, *changes: Change, by: str = ANN) -> None:
    store = ReviewStore(folder, clock=lambda: "2026-11-23T08:15:00Z")
    assert store.commit(store.current().revision, list(changes), by).review.revision  # type: ignore[union-attr]


def document(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "plan.json").read_text(encoding="utf-8"))  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def triangles(planned_room: Path) -> dict[str, FloatArray]:
    """GlobalId -> (N, 3, 3) of products, as IfcOpenShell places them in the file's world, metres."""
    model = ifcopenshell.open(str(planned_room / "room.ifc"))
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    found = {}
    for product in model.by_type("IfcElement"):
        if product.Representation and not product.is_a("IfcOpeningElement"):
            mesh = ifcopenshell.geom.create_shape(settings, product).geometry
            vertices = np.array(mesh.verts).reshape(-1, 3)
            found[product.GlobalId] = vertices[np.array(mesh.faces).reshape(-1, 3)]
    return found


def first_hit(triangles: dict[str, FloatArray], start: FloatArray, direction: FloatArray) -> str:
    """GlobalId of the product that a ray meets first, by Cramer's rule on every triangle."""
    nearest = {}
    for guid, corners in triangles.items():
        a, b, c = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], np.broadcast_to(-direction, (1, 3))
        columns = np.stack([a, b, np.broadcast_to(c, a.shape)], axis=2)
        regular = np.abs(np.linalg.det(columns)) > 1e-12
        u, v, t = np.linalg.solve(columns[regular], (start - corners[regular, 0])[:, :, None])[:, :, 0].T
        inside = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6) & (t > 1e-6)
        if inside.any():
            nearest[guid] = t[inside].min()
    return min(nearest, key=lambda guid: nearest[guid])


# -------------------------------------------------------------------------------------------------- unseen
Rows = dict[tuple[str, str], list[dict[str, Any]]]


def left_out_by_place(folder: Path) -> Rows:
    """Name of room or element, and floor -> what positions see and the plan leaves out, most first."""
    plan, places = document(folder), dict[tuple[str, str], list[dict[str, Any]]]()
    floors = {floor["id"]: floor["name"] for floor in plan["floors"]}
    for row in plan["why"]["unseen_surfaces"]:
        if row["reason"] == "not worth a station":
            name = row["room"]["name"] if row["room"] else row["name"]
            places.setdefault((name, floors[row["floor"]]), []).append(row)
    return dict(sorted(places.items(), key=lambda place: -area_of(place[1])))


def area_of(rows: list[dict[str, Any]]) -> float:
    return float(sum(row["area_m2"] for row in rows))


def as_rows(folder: Path, *areas_m2: float) -> None:
    """Have plan.json leave out these areas of its first elements, in no known room."""
    plan = document(folder)
    plan["why"] = None
    plan["unseen"] = [
        {**row, "unseen_area_m2": area_m2} for row, area_m2 in zip(plan["unseen"], areas_m2, strict=False)
    ]
    (folder / "plan.json").write_text(json.dumps(plan))


def test_rooms_become_topics_most_unseen_first_and_elements_where_no_room_is_known(
    issues: list[Topic], planned_room: Path
) -> None:
    places = left_out_by_place(planned_room / "plan")
    assert [name for name, _ in places] == ["Room", "Floor"]
    for topic, ((name, floor), rows) in zip(issues, places.items(), strict=True):
        title = f"{name} ({floor}): {area_of(rows):.1f} m² not covered by the planned scan"
        assert topic.text("Topic/Title") == title
        assert topic.markup.find("Topic").get("TopicStatus") == "Open"  # type: ignore[union-attr]
        label = name if rows[0]["room"] else rows[0]["kind"]
        assert [label.text for label in topic.markup.findall("Topic/Labels")] == [floor, label]
        largest_first = sorted(rows, key=lambda row: -row["area_m2"])
        assert topic.ifc_guids == list(dict.fromkeys(row["source_id"] for row in largest_first))
        assert topic.text("Header/File/Filename") == "room.ifc"
        assert topic.markup.find("Comment") is None


def test_descriptions_sum_what_is_unseen_by_element_and_reason_and_name_the_next_station(
    issues: list[Topic], planned_room: Path
) -> None:
    places = left_out_by_place(planned_room / "plan")
    room = places["Room", "Ground floor"]
    elements: Counter[str] = Counter()
    for row in room:
        elements[row["name"]] += row["area_m2"]
    listed = ", ".join(f"{name} {area_m2:.2f} m²" for name, area_m2 in elements.most_common())
    lines = issues[0].text("Topic/Description").splitlines()
    assert (
        lines[0]
        == f"No planned station captures {area_of(room):.2f} m² of surface here that a scanner could: {listed}."
    )
    spot = max(room, key=lambda row: float(row["area_m2"]))["best_spot"]
    at = ", ".join(f"{value:.2f}" for value in spot["position"])
    assert lines[1].startswith(f"One more station with its sensor at {at} (m, model coordinates) would add ")
    assert f" {spot['adds_m2']:.2f} m² " in lines[1]
    surfaces = document(planned_room / "plan")["why"]["unseen_surfaces"]
    high_m2 = area_of([row for row in surfaces if row["room"] and row["reason"] == "outside the field of view"])
    assert lines[2] == f"Besides, no valid position captures as required: outside the field of view {high_m2:.2f} m²."
    assert lines[3].startswith("Close the topic if that is acceptable")


def test_small_places_share_the_last_topic(room_folder: Path) -> None:
    plan = room_folder / "plan"
    shutil.rmtree(plan / "viewer")  # no snapshots are drawn then
    as_rows(plan, 0.2, 0.6, 0.3)
    rows = document(plan)["unseen"]
    large, small = exported(plan)[0]
    assert large.ifc_guids == [rows[1]["source_id"]]
    assert small.text("Topic/Title") == "2 smaller places: 0.5 m² not covered by the planned scan"
    assert small.ifc_guids == [rows[2]["source_id"], rows[0]["source_id"]]
    assert f"{rows[2]['name']} (Ground floor) 0.30 m²" in small.text("Topic/Description")
    as_rows(plan, 0.2)
    (alone,) = exported(plan)[0]
    assert alone.text("Topic/Title").startswith(f"{rows[0]['name']} (Ground floor): 0.2 m² ")


def test_topics_of_the_plan_have_its_time_or_that_of_the_environment(
    room_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = room_folder / "plan"
    shutil.rmtree(plan / "viewer")
    os.utime(plan / "plan.json", (0, 1_763_971_200))
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    assert exported(plan)[0][0].text("Topic/CreationDate") == "2025-11-24T08:00:00Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert exported(plan)[0][0].text("Topic/CreationDate") == "1970-01-02T00:00:00Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(EnvironmentVariableError, match="SOURCE_DATE_EPOCH: got 'yesterday', expected whole seconds"):
        exported(plan)


def test_cameras_see_their_element_in_the_coordinates_of_the_ifc_file(
    issues: list[Topic], triangles: dict[str, FloatArray]
) -> None:
    for topic in issues:
        at_m, forward, up = (topic.vector(name) for name in ("CameraViewPoint", "CameraDirection", "CameraUpVector"))
        assert at_m[0] > 40_000, "far from the origin, as the file is"
        assert np.isclose([np.linalg.norm(forward), np.linalg.norm(up)], 1.0, atol=1e-5).all()
        assert abs(forward @ up) < 1e-5
        assert up[2] >= 0
        assert first_hit(triangles, at_m, forward) in topic.ifc_guids


def test_snapshots_show_the_element_in_the_middle_and_what_is_unseen_of_it(issues: list[Topic]) -> None:
    n_strong = 0
    for topic in issues:
        picture = topic.picture()
        assert picture.shape == (480, 640, 3)
        red, _, blue = picture[240, 320]
        assert red > blue + 20, "the element's colour, where all others are grey"
        warmth = picture[:, :, 0] - picture[:, :, 2]
        n_strong += bool((warmth > 90).any())
    assert n_strong == len(issues), "each camera sees some of its element's unseen surface"


def test_places_beyond_the_number_of_topics_share_one(room_folder: Path) -> None:
    plan = room_folder / "plan"
    shutil.rmtree(plan / "viewer")
    as_rows(plan, 3.0, 2.0, 1.0)
    rows = document(plan)["unseen"]
    topics, (remark, _) = exported(plan, max_topics=1)
    assert [topic.ifc_guids for topic in topics] == [[rows[0]["source_id"]], [row["source_id"] for row in rows[1:]]]
    assert remark == (
        "1 of 3 rooms and elements with 0.5 m2 unseen or more have a topic of their own; the others, with 3.00 m2 in "
        "all, share one; --max-topics sets the number"
    )
    topics, remarks = exported(plan, max_topics=0)
    assert not topics
    assert "0 of 3 rooms and elements" in remarks[0]
    assert "holds no topic" in remarks[-1]


# ------------------------------------------------------------------------------------------------ comments
def test_comments_keep_their_words_author_time_and_status(room_folder: Path) -> None:
    plan = room_folder / "plan"
    station = document(plan)["stations"][0]["id"]
    review(plan, AddComment("Is <this> & that\nfree by Monday? \ufffe", station), AddComment("x" * 300, None))
    review(plan, AddComment("Settled", station, resolved=False), by=BEN)
    review(plan, ResolveComment("C003"), AssignComment("C001", "Kim", "2026-12-01"), by=ANN)
    first, second, third = exported(plan, max_topics=0)[0]
    assert first.text("Topic/Title") == f"{station}: Is <this> & that"
    assert (first.text("Topic/AssignedTo"), first.text("Topic/DueDate")) == ("Kim", "2026-12-01T00:00:00Z")
    assert second.markup.find("Topic/AssignedTo") is None and second.markup.find("Topic/DueDate") is None
    assert len(second.text("Topic/Title")) == 100
    for topic, author, status, text in (
        (first, ANN, "Open", "Is <this> & that\nfree by Monday? \\ufffe"),
        (second, ANN, "Open", "x" * 300),
        (third, BEN, "Resolved", "Settled"),
    ):
        assert topic.markup.find("Topic").get("TopicStatus") == status  # type: ignore[union-attr]
        assert topic.markup.find("Topic").get("TopicType") == "Comment"  # type: ignore[union-attr]
        for path in ("Topic/CreationAuthor", "Comment/Author"):
            assert topic.text(path) == author
        for path in ("Topic/CreationDate", "Comment/Date"):
            assert topic.text(path) == "2026-11-23T08:15:00Z"
        for path in ("Topic/Description", "Comment/Comment"):
            assert topic.text(path) == text
        row, said = topic.markup.find("Viewpoints"), topic.markup.find("Comment/Viewpoint")
        assert row is not None
        assert said is not None
        assert row.get("Guid") == said.get("Guid")


def test_the_photo_of_a_comment_is_a_document_of_its_topic(room_folder: Path) -> None:
    plan, out = room_folder / "plan", io.BytesIO()
    Image.new("RGB", (40, 30), "teal").save(out, "JPEG")
    sha256 = ReviewStore(plan).keep_photo(out.getvalue())
    review(plan, AddComment("Door locked", photo=sha256), AddComment("No photo"))
    assert [topic.document for topic in exported(plan, max_topics=0)[0]] == [out.getvalue(), None]
    (plan / "review-photos" / f"{sha256}.jpg").unlink()  # the comment is there all the same
    assert [topic.document for topic in exported(plan, max_topics=0)[0]] == [None, None]


def pointed_at(topic: Topic, place_m: FloatArray) -> bool:
    """Whether a camera looks straight at a place."""
    towards = place_m - topic.vector("CameraViewPoint")
    return bool(np.allclose(towards / np.linalg.norm(towards), topic.vector("CameraDirection"), atol=1e-4))


@pytest.mark.slow
def test_comments_look_at_their_station_element_pin_or_building(
    room_folder: Path, triangles: dict[str, FloatArray]
) -> None:
    plan = room_folder / "plan"
    station = document(plan)["stations"][0]
    wall = next(row for row in document(plan)["unseen"] if row["name"] == "Wall west")
    at_m = np.array(station["position"])
    moved_m = at_m + np.array([0.3, -0.2, 0.0])
    pin_m = at_m + np.array([0.5, 0.5, -0.7])
    review(
        plan,
        AddComment("station", station["id"]),
        AddComment("element", wall["element"]),
        AddComment("pin", None, (float(pin_m[0]), float(pin_m[1]), float(pin_m[2]))),
        AddComment("plan"),
    )
    station_topic, wall_topic, pin_topic, whole = exported(plan, max_topics=0)[0]
    assert pointed_at(station_topic, at_m)
    assert pointed_at(pin_topic, pin_m)
    assert station_topic.ifc_guid is pin_topic.ifc_guid is whole.ifc_guid is None
    assert wall_topic.ifc_guid == wall["source_id"]
    seen_at_m = wall_topic.vector("CameraViewPoint")
    assert first_hit(triangles, seen_at_m, wall_topic.vector("CameraDirection")) == wall["source_id"]
    corners_m = np.concatenate([each.reshape(-1, 3) for each in triangles.values()])
    assert whole.vector("CameraViewPoint")[2] > corners_m[:, 2].max(), "from outside, above"
    to_middle_m = (corners_m.min(axis=0) + corners_m.max(axis=0)) / 2 - whole.vector("CameraViewPoint")
    assert np.linalg.norm(np.cross(to_middle_m, whole.vector("CameraDirection"))) < 1.0
    for topic in (station_topic, pin_topic):
        red, green, blue = topic.picture()[240, 320]
        assert (red, green, blue) == (181, 35, 107), "the pin"
    review(plan, MoveStation(station["id"], (float(moved_m[0]), float(moved_m[1]), float(moved_m[2]))))
    assert pointed_at(exported(plan, max_topics=0)[0][0], moved_m)
    review(plan, RemoveStation(station["id"]))
    assert len(exported(plan, max_topics=0)[0]) == 4


def test_a_review_that_cannot_be_read_is_refused(room_folder: Path) -> None:
    (room_folder / "plan" / "review.usda").write_text("no USD")
    with pytest.raises(PlanFolderError, match=r"review\.usda"):
        exported(room_folder / "plan")
    assert not (room_folder / "issues.bcfzip").exists()


# ------------------------------------------------------------------------------------------------- as a file
@pytest.mark.slow
def test_the_same_plan_gives_the_same_bytes_and_ids_stay_with_their_subject(room_folder: Path) -> None:
    plan = room_folder / "plan"
    review(plan, AddComment("Look"))
    one, _ = exported(plan, "one")
    exported(plan, "two")
    assert (room_folder / "one.bcfzip").read_bytes() == (room_folder / "two.bcfzip").read_bytes()
    moved = Path(shutil.copytree(room_folder, room_folder.parent / "elsewhere")) / "plan"
    exported(moved)
    assert (moved.parent / "issues.bcfzip").read_bytes() == (room_folder / "one.bcfzip").read_bytes()
    review(plan, ResolveComment("C001"))
    resolved, _ = exported(plan)
    assert [topic.guid for topic in resolved] == [topic.guid for topic in one]
    assert len(one) == 3
    assert resolved[0].markup.find("Topic").get("TopicStatus") == "Resolved"  # type: ignore[union-attr]
    guids = [element.get("Guid") for topic in one for element in topic.markup.iter() if element.tag != "Viewpoint"]
    guids = [guid for guid in guids if guid]
    assert len(set(guids)) == len(guids)


@pytest.fixture
def rewritten(room_folder: Path) -> Callable[..., Path]:
    """Call with keys of plan.json's `scene` to replace; the plan folder."""

    def write(**scene: Any) -> Path:
        plan = room_folder / "plan"
        (plan / "plan.json").write_text(json.dumps({**(old := document(plan)), "scene": {**old["scene"], **scene}}))
        return plan

    return write


@pytest.mark.slow
def test_ids_stay_with_the_room_in_later_plans_of_a_model_and_are_others_in_another_model(
    issues: list[Topic], rewritten: Callable[..., Path]
) -> None:
    later, _ = exported(rewritten(file="other name.ifc"), max_topics=1)
    assert later[0].guid == issues[0].guid
    other, _ = exported(rewritten(sha256="0" * 64), max_topics=1)
    assert other[0].ifc_guids == issues[0].ifc_guids
    assert other[0].guid not in {topic.guid for topic in issues}


def test_elements_of_other_formats_are_told_by_their_own_ids(rewritten: Callable[..., Path]) -> None:
    plan = rewritten(format="usd", up_axis="Y")
    topics, remarks = exported(plan, max_topics=1)
    assert topics[0].ifc_guid is None
    row = max(document(plan)["unseen"], key=lambda row: float(row["unseen_area_m2"]))
    assert topics[0].view.findtext("Components/Selection/Component/AuthoringToolId") == row["source_id"]
    assert "the scene is usd: its elements have no IFC GlobalId" in remarks[1]
    assert remarks[2] == "cameras have z up, the scene file Y"


@pytest.mark.slow
def test_cameras_stay_in_the_coordinates_of_the_first_file_whatever_the_site_has(
    room_folder: Path, rewritten: Callable[..., Path]
) -> None:
    scene = document(room_folder / "plan")["scene"]
    other = {key: scene[key] for key in ("sha256", "format", "schema", "units", "metres_per_unit", "up_axis")}
    plan = rewritten(other_files=[{**other, "file": "ducts.ifc", "load_options": scene["load_options"]}])
    here = exported(plan)[0][0]
    path = room_folder / "site.bcfzip"
    on_map = FrameRequest(crs="EPSG:25832", origin_m=(5e5, 5.3e6, 100.0), rotation_rad=0.3)
    remarks = export_plan("bcf", plan, path, frame=on_map).remarks
    there = read(path)[0]
    for name in ("CameraViewPoint", "CameraDirection"):
        assert there.vector(name).tolist() == here.vector(name).tolist()
    assert [row.text for row in there.markup.findall("Header/File/Filename")] == ["room.ifc", "ducts.ifc"]
    assert "cameras are in the coordinates of room.ifc, the first of several files" in remarks
    assert "cameras are in the scene file's coordinates, metres, as BCF wants, not in the site's" in remarks


@pytest.mark.slow
def test_without_the_building_there_are_cameras_and_no_snapshots(room_folder: Path) -> None:
    plan = room_folder / "plan"
    review(plan, AddComment("Look", document(plan)["unseen"][0]["element"]))
    with_pictures, _ = exported(plan)
    shutil.rmtree(plan / "viewer")
    topics, (remark,) = exported(plan)
    assert [topic.guid for topic in topics] == [topic.guid for topic in with_pictures]
    assert [topic.ifc_guids for topic in topics] == [topic.ifc_guids for topic in with_pictures]
    assert {topic.snapshot for topic in topics} == {None}
    assert remark.startswith("no snapshots, and cameras may stand behind walls: viewer/stage.usdc is not in")


def test_floors_choose_topics(room_folder: Path) -> None:
    plan = room_folder / "plan"
    shutil.rmtree(plan / "viewer")  # no snapshots are drawn then
    as_rows(plan, 3.0, 2.0, 1.0)
    changed = document(plan)
    changed["unseen"][0]["floor"] = ""
    (plan / "plan.json").write_text(json.dumps(changed))
    review(plan, AddComment("of the station", changed["stations"][0]["id"]), AddComment("of the plan"))
    all_of_it, _ = exported(plan)
    chosen, _ = exported(plan, floors=(changed["floors"][0]["name"],))
    assert len(all_of_it) == len(changed["unseen"]) + 2
    assert {topic.guid for topic in all_of_it} - {topic.guid for topic in chosen} == {
        topic.guid for topic in all_of_it if topic.ifc_guid == changed["unseen"][0]["source_id"]
    }
