"""Topics for model checkers and authoring programs as BCF 2.1: comments of the review, and what stays unseen by room.

    plan.bcfzip  bcf.version  project.bcfp  <topic>/markup.bcf  <topic>/viewpoint.bcfv  <topic>/snapshot.png
                 <topic>/photo.jpg

Coordinates are those of the scene file, metres, z up, as BCF wants them. Ids follow from the model and what a topic is
about (RFC 4122, version 5): a topic of a later plan of the same model replaces that of the plan before. Times are of
the review and of plan.json, files in the zip have none: same plan, same bytes.

Source: buildingSMART, BCF-XML release 2.1: markup.xsd, visinfo.xsd, project.xsd, version.xsd, README.
"""

from __future__ import annotations

import re
import uuid
import zipfile
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from planner_core.errors import escaped
from planner_core.export.bcf_topics import LEAST_AREA_M2, Topic, Topics, UnseenPlace
from planner_core.export.bcf_views import FIELD_OF_VIEW_DEG, Views
from planner_core.export.options import Options
from planner_core.export.sheets.building import building_of
from planner_core.model import FloatArray
from planner_core.plan_folder.pictures import Eye
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import Progress, ProgressEvent
from planner_core.review.photos import photo_file
from planner_core.review.store import ReviewStore

VERSION = "2.1"
VIEWPOINT_FILE, SNAPSHOT_FILE = "viewpoint.bcfv", "snapshot.png"
PHOTO_FILE = "photo.jpg"

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_OID, "tlsplan bcf")
#: The first day that a zip can name.
_ZIP_TIME = (1980, 1, 1, 0, 0, 0)
_GLOBAL_ID = re.compile(r"[0-3][0-9A-Za-z_$]{21}")


def write_bcf(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write all comments, and what is unseen: a topic per place, and one for all small places.

    Raises
    ------
    RequirementError
        A floor that is not there.
    PlanFolderError
        The review can't be read.
    """
    store = ReviewStore(plan.folder)
    planned, review = store.plan(), store.current()
    building = building_of(plan)
    found = Topics(plan, None if isinstance(building, str) else building, options)
    views = Views(None if isinstance(building, str) else building)
    unseen = found.unseen_places()
    large = [place for place in unseen if place.area_m2 >= LEAST_AREA_M2]
    own, others = large[: options.max_topics], [*large[options.max_topics :], *unseen[len(large) :]]
    topics = [*found.of_comments(planned, review), *(found.of_place(place) for place in own)]
    if others and options.max_topics:
        topics.append(found.of_others(others) if len(others) > 1 else found.of_place(others[0]))
    scene = plan.document["scene"]
    model_id = "/".join(each["sha256"] for each in (scene, *scene["other_files"]))
    with zipfile.ZipFile(path, "w") as archive:
        _put(archive, "bcf.version", _version())
        _put(archive, "project.bcfp", _project(plan, _guid(model_id, "project")))
        for number, topic in enumerate(topics):
            progress(ProgressEvent("bcf", number, len(topics), topic.title))
            _put_topic(archive, plan, topic, views, model_id=model_id, index=number)
    return (
        *_on_what_is_left_out(own, large[options.max_topics :], options),
        *_on_coordinates(plan),
        *((f"no snapshots, and cameras may stand behind walls: {building}",) if isinstance(building, str) else ()),
        *(() if topics else ("there are no comments and nothing unseen: the file holds no topic",)),
    )


def _on_what_is_left_out(
    own: Sequence[UnseenPlace], others: Sequence[UnseenPlace], options: Options
) -> tuple[str, ...]:
    if not others:
        return ()
    area_m2 = sum(place.area_m2 for place in others)
    where = "share one" if options.max_topics else "have none"
    return (
        f"{len(own)} of {len(own) + len(others)} rooms and elements with {LEAST_AREA_M2:g} m2 unseen or more have a "
        f"topic of their own; the others, with {area_m2:.2f} m2 in all, {where}; --max-topics sets the number",
    )


def _on_coordinates(plan: PlanSource) -> tuple[str, ...]:
    scene, remarks = plan.document["scene"], []
    if scene["format"] != "ifc":
        remarks.append(f"the scene is {scene['format']}: its elements have no IFC GlobalId, topics have their own ids")
    if scene["up_axis"] != "Z":
        remarks.append(f"cameras have z up, the scene file {scene['up_axis']}")
    if scene["other_files"]:
        remarks.append(f"cameras are in the coordinates of {scene['file']}, the first of several files")
    if not plan.frame.is_scene:
        remarks.append("cameras are in the scene file's coordinates, metres, as BCF wants, not in the site's")
    return tuple(remarks)


def _put_topic(
    archive: zipfile.ZipFile, plan: PlanSource, topic: Topic, views: Views, *, model_id: str, index: int
) -> None:
    folder, view = _guid(model_id, topic.key), _guid(model_id, f"view/{topic.key}")
    place = views.first_seen(topic.places)
    eye = views.eye(place)
    picture = views.picture(eye, place)
    markup = _markup(plan, topic, folder, view, _guid(model_id, f"said/{topic.key}"), index, picture is not None)
    photo = photo_file(plan.folder, topic.photo)
    if photo is not None:
        _add_photo(markup, _guid(model_id, f"photo/{topic.key}"))
        _put_bytes(archive, f"{folder}/{PHOTO_FILE}", photo.read_bytes())
    _put(archive, f"{folder}/markup.bcf", markup)
    _put(archive, f"{folder}/{VIEWPOINT_FILE}", _viewpoint(plan, topic, view, eye))
    if picture is not None:
        _put_bytes(archive, f"{folder}/{SNAPSHOT_FILE}", picture)


def _guid(model_id: str, key: str) -> str:
    return str(uuid.uuid5(_NAMESPACE, f"{model_id}/{key}"))


# --------------------------------------------------------------------------------------------------- files
def _version() -> ElementTree.Element:
    root = ElementTree.Element("Version", {"VersionId": VERSION})
    _add(root, "DetailedVersion", VERSION)
    return root


def _project(plan: PlanSource, project_id: str) -> ElementTree.Element:
    root = ElementTree.Element("ProjectExtension")
    _add(_add(root, "Project", ProjectId=project_id), "Name", plan.title)
    _add(root, "ExtensionSchema")  # the schema wants it, empty where the project extends nothing
    return root


def _markup(
    plan: PlanSource, topic: Topic, topic_id: str, view_id: str, comment_id: str, index: int, has_picture: bool
) -> ElementTree.Element:
    root = ElementTree.Element("Markup")
    header = _add(root, "Header")
    scene = plan.document["scene"]
    for file in (scene["file"], *(other["file"] for other in scene["other_files"])):
        _add(_add(header, "File", isExternal="true"), "Filename", str(file))
    row = _add(root, "Topic", Guid=topic_id, TopicType=topic.kind, TopicStatus=topic.status)
    _add(row, "Title", topic.title)
    _add(row, "Index", str(index))
    for label in topic.labels:
        _add(row, "Labels", label)
    _add(row, "CreationDate", topic.time)
    _add(row, "CreationAuthor", topic.author)
    if topic.due:
        _add(row, "DueDate", f"{topic.due}T00:00:00Z")
    if topic.assignee:
        _add(row, "AssignedTo", topic.assignee)
    _add(row, "Description", topic.description)
    if topic.is_comment:
        comment = _add(root, "Comment", Guid=comment_id)
        _add(comment, "Date", topic.time)
        _add(comment, "Author", topic.author)
        _add(comment, "Comment", topic.description)
        _add(comment, "Viewpoint", Guid=view_id)
    view = _add(root, "Viewpoints", Guid=view_id)
    _add(view, "Viewpoint", VIEWPOINT_FILE)
    if has_picture:
        _add(view, "Snapshot", SNAPSHOT_FILE)
    return root


def _add_photo(markup: ElementTree.Element, photo_id: str) -> None:
    """After the description of the topic, as the schema wants it."""
    topic = markup.find("Topic")
    assert topic is not None
    document = _add(topic, "DocumentReference", Guid=photo_id, isExternal="false")
    _add(document, "ReferencedDocument", PHOTO_FILE)
    _add(document, "Description", "Photo")


def _viewpoint(plan: PlanSource, topic: Topic, view_id: str, eye: Eye) -> ElementTree.Element:
    root = ElementTree.Element("VisualizationInfo", {"Guid": view_id})
    components = _add(root, "Components")
    selection = _add(components, "Selection") if topic.source_ids else components
    for source_id in topic.source_ids:
        if plan.document["scene"]["format"] == "ifc" and _GLOBAL_ID.fullmatch(source_id):
            _add(selection, "Component", IfcGuid=source_id)
        else:
            _add(_add(selection, "Component"), "AuthoringToolId", source_id)
    _add(components, "Visibility", DefaultVisibility="true")
    camera = _add(root, "PerspectiveCamera")
    _add_vector(camera, "CameraViewPoint", eye.position_m + plan.document["scene"]["offset"])
    _add_vector(camera, "CameraDirection", eye.forward)
    _add_vector(camera, "CameraUpVector", eye.up)
    _add(camera, "FieldOfView", f"{FIELD_OF_VIEW_DEG:g}")
    return root


def _add(parent: ElementTree.Element, tag: str, text: str = "", **attributes: str) -> ElementTree.Element:
    element = ElementTree.SubElement(parent, tag, {name: escaped(value) for name, value in attributes.items()})
    if text:
        element.text = escaped(text)
    return element


def _add_vector(parent: ElementTree.Element, tag: str, vector: FloatArray) -> None:
    element = _add(parent, tag)
    for axis, value in zip("XYZ", vector.tolist(), strict=True):
        _add(element, axis, f"{value + 0.0:.6f}")


def _put(archive: zipfile.ZipFile, name: str, root: ElementTree.Element) -> None:
    ElementTree.indent(root, " ")
    _put_bytes(archive, name, ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _put_bytes(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, _ZIP_TIME)
    entry.create_system, entry.external_attr = 3, 0o644 << 16  # the same on every system
    entry.compress_type = zipfile.ZIP_STORED if name.endswith((".png", ".jpg")) else zipfile.ZIP_DEFLATED
    archive.writestr(entry, content)
