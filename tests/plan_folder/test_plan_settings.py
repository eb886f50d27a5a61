"""plan.json read back: the settings and load options it was made from, to the last bit, and the scene file."""

import hashlib
import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from planner_core.engine.patch_mode import scan_mode_of
from planner_core.errors import PlanFolderError
from planner_core.model import (
    Greedy,
    GroundPick,
    KeepOut,
    NetworkKind,
    OverlapMeasure,
    OverlapOf,
    Paper,
    PartRequirement,
    Plan,
    PlanSettings,
    PointLimits,
    PreAlignment,
    PriorStation,
    Proven,
    Requirements,
    Role,
    Scanner,
    Scope,
    Site,
)
from planner_core.model.spatial_search import SearchSettings
from planner_core.plan_folder.plan_json import plan_document, plan_text, read_plan_json
from planner_core.plan_folder.plan_settings import find_scene, load_options_of, settings_of
from planner_core.scanner.load_scanner import list_scanners
from planner_core.scene.load import LoadOptions, load_scene

# ------------------------------------------------------------------------------------------ any settings
above_0 = st.floats(1e-6, 1e6)
at_least_0 = st.floats(0, 1e6)
anywhere = st.floats(-1e7, 1e7)
fraction = st.floats(0, 1, exclude_min=True)
word = st.text(st.characters(codec="utf-8", exclude_categories=("Cs",)), max_size=8)
place = st.tuples(anywhere, anywhere, anywhere)
corner = st.tuples(anywhere, anywhere)
asked = st.builds(PointLimits, *(st.none() | at_least_0 for _ in range(4)))
PART = {
    "name": word.map(lambda name: f"part {name}"),
    "coverage": fraction.filter(bool),
    "limits": asked,
    "seen_from": st.integers(1, 9),
    "floors": st.lists(word, max_size=2).map(tuple),
    "classes": st.lists(word, max_size=2).map(tuple),
    "zone": st.just(()) | st.lists(corner, min_size=3, max_size=5).map(tuple),
    "heights_m": st.none() | corner.map(sorted).map(tuple),
}
part = st.builds(PartRequirement, **PART)
REQUIREMENTS = {
    "coverage": fraction,
    "overlap": fraction,
    "floors": st.lists(word, max_size=2).map(tuple),
    "limits": asked,
    "seen_from": st.integers(1, 9),
    "reflectivity": fraction,
    "parts": st.lists(part, max_size=3, unique_by=lambda each: each.name).map(tuple),
    "network": st.sampled_from(list(NetworkKind)),
    "min_strength": fraction,
    "min_probability": st.floats(0.0, 0.999),
    "doors_change": st.booleans(),
    "targets": st.none() | st.booleans(),
    "pre_alignment": st.sampled_from([None, *PreAlignment]),
    "deliverable": st.sampled_from(["none", "survey"]),
    "scope": st.sampled_from(list(Scope)),
    "overlap_measure": st.sampled_from(list(OverlapMeasure)),
    "overlap_of": st.sampled_from(list(OverlapOf)),
}
requirements = st.builds(Requirements, **REQUIREMENTS)
prior = st.builds(
    PriorStation,
    id=word,
    position_m=place,
    role=st.sampled_from(list(Role)),
    floor=word,
    instrument_height_m=st.none() | above_0,
    radius_m=above_0,
    # A radius is only one of forbidden places.
).map(lambda station: station if station.role == "forbidden" else replace(station, radius_m=PriorStation.radius_m))
SITE = {
    "entrances_m": st.lists(place, max_size=2).map(tuple),
    "keep_out": st.lists(
        st.builds(KeepOut, st.lists(corner, min_size=3, max_size=5).map(tuple), word, st.booleans(), word), max_size=2
    ).map(tuple),
    "prior": st.lists(prior, max_size=2).map(tuple),
    "carrier_radius_m": st.none() | above_0,
    "step_m": st.none() | above_0,
    "carrier_height_m": st.none() | above_0,
    "opens_doors": st.booleans(),
    "start_m": st.none() | place,
    "end_m": st.none() | place,
    "returns": st.booleans(),
    "ground_picks": st.lists(st.builds(GroundPick, place, st.booleans(), word), max_size=3).map(tuple),
}
site = st.builds(Site, **SITE | {"returns": st.just(False)}) | st.builds(Site, **SITE | {"end_m": st.none()})
SCANNER = {
    "name": word,
    "title": word,
    "source": word,
    "range_min_m": at_least_0,
    "range_max_m": above_0,
    "n_azimuths": st.integers(1, 10**6),
    "elevation_rad": st.lists(anywhere, min_size=1, max_size=4).map(tuple),
    "instrument_height_min_m": above_0,
    "instrument_height_max_m": above_0,
    "instrument_height_usual_m": st.none() | above_0,
    "azimuth_range_rad": st.none() | corner,
    "azimuth_offset_rad": st.lists(anywhere, max_size=4).map(tuple),
    "inverted": st.booleans(),
    "mode": word,
    "seconds_per_scan": st.none() | above_0,
    "range_noise": st.lists(place, max_size=3).map(tuple),
    "ranging_accuracy": st.none() | corner,
    "angular_accuracy_rad": st.none() | above_0,
    "beam_divergence_rad": st.none() | above_0,
    "beam_diameter_m": st.none() | above_0,
    "beam_width_at": st.sampled_from(["", "1/e", "FWHM"]),
    "wavelength_m": st.none() | above_0,
    "dual_axis_compensator": st.none() | st.booleans(),
    "pre_alignment": st.sampled_from(list(PreAlignment)),
}
scanner = st.builds(Scanner, **SCANNER)
method = st.one_of(
    st.just(Greedy()),
    st.builds(Proven, at_least_0, st.none() | at_least_0, st.none() | st.integers(0, 2**63), prove=st.booleans()),
    st.builds(
        Paper,
        search=st.sampled_from(["ls", "none"]),
        overlap_radius_m=at_least_0,
        spatial=st.builds(SearchSettings, step_m=above_0, lattice_origin_m=st.none() | place),
    ),
)
ANY_SETTINGS = {
    "scanner": scanner,
    "requirements": requirements,
    "objective": st.sampled_from(["fewest", "coverage", "time"]),
    "max_stations": st.none() | st.integers(1, 99),
    "method": method,
    "seed": st.integers(0, 2**63),
    "grid_step_m": above_0,
    "instrument_heights_m": st.lists(st.floats(1e-6, 100), max_size=3).map(tuple),
    "height_step_m": above_0,
    "clearance_m": at_least_0,
    "ground_ring_radius_m": at_least_0,
    "n_ground_ring_rays": st.integers(1, 99),
    "special_places": st.booleans(),
    "max_patch_area_m2": above_0,
    "scan_mode": st.sampled_from(["beams", "patches"]),
    "site": site,
    "refine": st.booleans(),
    "seconds_per_scan": st.none() | above_0,
    "set_up_s": at_least_0,
    "set_up_tolerance_m": at_least_0,
    "walking_m_per_s": above_0,
}


def fitting(**told: Any) -> PlanSettings:
    """Settings of what is told, but for what does not fit together."""
    if told["requirements"].limits_noise:
        told["scanner"] = replace(told["scanner"], range_noise=((1.0, 0.5, 0.001),))
    if told["objective"] != "fewest" and not isinstance(told["method"], Proven):
        told["objective"] = "fewest"
    if told["objective"] == "time" and told["scanner"].seconds_per_scan is None:
        told["seconds_per_scan"] = 60.0
    told["max_stations"] = (told["max_stations"] or 1) if told["objective"] == "coverage" else None
    keeps = told["objective"] == "fewest" and isinstance(told["method"], Proven)
    roles = {Role.FORBIDDEN} if isinstance(told["method"], Paper) else set(Role) - (set() if keeps else {Role.KEPT})
    prior = tuple(station for station in told["site"].prior if station.role in roles)
    told["site"] = replace(told["site"], prior=prior)
    if isinstance(told["method"], Paper):
        parts = tuple(replace(part, seen_from=1) for part in told["requirements"].parts)
        usual = {"overlap_measure": OverlapMeasure.SMALLER_SHARE, "overlap_of": OverlapOf.ALL_SEEN}
        told["requirements"] = replace(told["requirements"], seen_from=1, parts=parts, **usual)
    return PlanSettings(**told)


any_settings = st.builds(fitting, **ANY_SETTINGS)


def document_of(plan: Plan, told: PlanSettings) -> dict[str, Any]:
    """What a reader of the file gets."""
    survey = replace(plan.survey, scan_mode=scan_mode_of(told.scan_mode, plan.survey.template))
    read: dict[str, Any] = json.loads(plan_text(replace(plan, survey=survey, settings=told)))
    return read


@pytest.mark.parametrize(
    ("kind", "varied"),
    [
        (PlanSettings, ANY_SETTINGS),
        (Scanner, SCANNER),
        (Requirements, REQUIREMENTS),
        (PartRequirement, PART),
        (Site, SITE),
    ],
)
def test_settings_of_the_next_test_vary_every_field(kind: type, varied: dict[str, object]) -> None:
    assert set(varied) == {field.name for field in fields(kind)}


@pytest.mark.slow
@given(told=any_settings)
@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
def test_settings_read_from_plan_json_equal_those_written_to_the_last_bit(plan: Plan, told: PlanSettings) -> None:
    assert settings_of(document_of(plan, told)) == told


def test_plans_of_before_measure_overlap_as_they_did(plan: Plan) -> None:
    document = document_of(plan, plan.settings)
    assert document["requirements"]["overlap_measure"] == "smaller-share"
    assert document["requirements"]["overlap_of"] == "all-seen"
    del document["requirements"]["overlap_measure"], document["requirements"]["overlap_of"]
    assert settings_of(document) == settings_of(document_of(plan, plan.settings))
    other = replace(plan.settings.requirements, overlap_measure="jaccard", overlap_of="seen-as-required")
    written = document_of(plan, replace(plan.settings, requirements=other))["requirements"]
    assert (written["overlap_measure"], written["overlap_of"]) == ("jaccard", "seen-as-required")


@pytest.mark.slow
def test_settings_of_every_scanner_of_ours_are_read_back(plan: Plan) -> None:
    for each in list_scanners():
        told = replace(plan.settings, scanner=each, scan_mode="beams")
        assert settings_of(document_of(plan, told)).scanner == each


def test_scan_mode_left_to_auto_is_read_as_the_one_that_was_used(plan: Plan) -> None:
    assert settings_of(document_of(plan, replace(plan.settings, scan_mode="auto"))).scan_mode == "beams"


def test_document_of_picks_noise_and_a_marked_floor_matches_the_schema(plan: Plan, tmp_path: Path) -> None:
    schema = json.loads((Path(__file__).parents[2] / "docs" / "formats" / "plan.schema.json").read_text())
    noisy = replace(plan.settings.scanner, range_noise=((1.0, 0.5, 0.001),), ranging_accuracy=(0.001, 1e-5))
    picks = (GroundPick((1.0, 2.0, 3.0), is_ground=False, floor="F0"),)
    told = replace(plan.settings, scanner=noisy, site=Site(ground_picks=picks))
    floors = tuple(replace(floor, origin="marked") for floor in plan.survey.floors)
    source = replace(
        plan.survey.scene.source, path=tmp_path / "scene.ifc", given_up_axis="Y", given_metres_per_unit=0.01
    )
    source.path.write_bytes(b"ISO-10303-21;")
    survey = replace(plan.survey, floors=floors, scene=replace(plan.survey.scene, source=source))
    document = json.loads(plan_text(replace(plan, settings=told, survey=survey), tmp_path / "plan"))
    assert document["source"] == {"path": "../scene.ifc", "other_paths": []}
    jsonschema.Draft202012Validator(schema).validate(document)
    for written, name in (
        (document["site"]["ground_picks"][0], "PickSection"),
        (document["scene"]["load_options"], "LoadOptions"),
        (document["scanner"], "Scanner"),
    ):
        assert set(written) == set(schema["$defs"][name]["properties"])


# ----------------------------------------------------------------------------------------- what is refused
def test_settings_of_a_plan_without_what_it_is_made_of_are_refused(plan: Plan) -> None:
    document = document_of(plan, plan.settings)
    del document["scanner"]["range_max_m"]
    with pytest.raises(PlanFolderError, match=r"^plan\.json: scanner: got no range_max_m, .*plan again$"):
        settings_of(document)


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        (("seed",), 1.5, "seed: got 1.5, expected a whole number"),
        (("seed",), True, "seed: got True, expected a whole number"),
        (("settings", "grid_step_m"), None, "settings.grid_step_m: got None, expected a finite number"),
        (("settings", "grid_step_m"), float("nan"), "settings.grid_step_m: got nan, expected a finite number"),
        (("scanner", "elevation_rad"), [0.1, "x"], r"scanner.elevation_rad\[1\]: got 'x', expected a finite number"),
        (("scanner", "azimuth_range_rad"), [1.0], r"scanner.azimuth_range_rad: got \[1.0\], expected a longer list"),
        (("site", "entrances"), [[1, 2]], r"site.entrances\[0\]: got \[1, 2\], expected a longer list"),
        (("site", "opens_doors"), 1, "site.opens_doors: got 1, expected true or false"),
        (("requirements",), [], r"requirements: got \[\], expected keys"),
        (("requirements", "parts"), ["x"], r"requirements.parts\[0\]: got 'x', expected keys"),
        (("method",), 3, "method: got 3, expected text"),
    ],
)
def test_settings_that_the_writer_never_wrote_are_refused_in_one_line(
    plan: Plan, where: tuple[str, ...], value: object, message: str
) -> None:
    document = inner = document_of(plan, plan.settings)
    for key in where[:-1]:
        inner = inner[key]
    inner[where[-1]] = value
    with pytest.raises(PlanFolderError, match=message) as refused:
        settings_of(document)
    assert "\n" not in str(refused.value)


# --------------------------------------------------------------------------------------------- the scene
QUAD = "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4\n"


@pytest.mark.parametrize(
    "options",
    [
        LoadOptions(),
        LoadOptions(metres_per_unit=0.0254 / 3, up_axis="Y", skip_bad_faces=True, glass="stop", doors="open"),
        LoadOptions(up_axis="Z", glass="return", doors="all"),
    ],
)
def test_load_options_are_read_back_as_they_were_told(plan: Plan, tmp_path: Path, options: LoadOptions) -> None:
    file = tmp_path / "quad.obj"
    file.write_text(QUAD)
    loaded = load_scene(file, options=options)
    scene = replace(plan.survey.scene, source=loaded.source)
    document = plan_document(replace(plan, survey=replace(plan.survey, scene=scene)))
    assert load_options_of(json.loads(json.dumps(document))) == (options,)


@pytest.fixture
def made(plan: Plan, tmp_path: Path) -> tuple[Path, dict[str, Any], Path]:
    """A plan folder (of plan.json alone), its document, and the scene file in another folder."""
    scene_file, folder = tmp_path / "models" / "quad.obj", tmp_path / "plans" / "first"
    scene_file.parent.mkdir()
    scene_file.write_text(QUAD)
    folder.mkdir(parents=True)
    scene = replace(plan.survey.scene, source=load_scene(scene_file).source)
    text = plan_text(replace(plan, survey=replace(plan.survey, scene=scene)), folder)
    (folder / "plan.json").write_text(text, encoding="utf-8")
    return folder, read_plan_json(folder), scene_file


def test_source_is_the_way_from_the_plan_folder_to_the_scene(made: tuple[Path, dict[str, Any], Path]) -> None:
    folder, document, scene_file = made
    assert document["source"] == {"path": "../../models/quad.obj", "other_paths": []}
    assert find_scene(folder, document)[0].resolve() == scene_file


@pytest.mark.parametrize("name", ["a\x1b[2J.obj", "a\uf03ab.obj", "\U0008375b.obj", "größe 日本.obj"])
def test_a_scene_is_found_under_any_name(plan: Plan, tmp_path: Path, name: str) -> None:
    """File servers write `:` as a character of private use, and names may have characters newer than Python's."""
    file = tmp_path / name
    file.write_text(QUAD)
    scene = replace(plan.survey.scene, source=load_scene(file).source)
    document = json.loads(plan_text(replace(plan, survey=replace(plan.survey, scene=scene)), tmp_path))
    assert find_scene(tmp_path, document) == (file,)


def test_scene_is_found_after_both_folders_moved_together(made: tuple[Path, dict[str, Any], Path]) -> None:
    folder, document, scene_file = made
    moved = folder.parents[1] / "moved"
    moved.mkdir()
    folder.parent.rename(moved / "plans")
    scene_file.parent.rename(moved / "models")
    (found,) = find_scene(moved / "plans" / "first", document)
    assert found.resolve() == moved / "models" / "quad.obj"


def test_scene_is_found_where_the_plan_folder_is_reached_by_a_link(
    made: tuple[Path, dict[str, Any], Path], tmp_path: Path
) -> None:
    folder, document, scene_file = made
    (tmp_path / "deep" / "er").mkdir(parents=True)
    link = tmp_path / "deep" / "er" / "plan"
    link.symlink_to(folder)
    assert find_scene(link, document)[0].resolve() == scene_file


def test_scene_is_looked_for_beside_the_plan_then_in_the_working_directory(
    made: tuple[Path, dict[str, Any], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, document, scene_file = made
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    scene_file.rename(work / "quad.obj")
    assert find_scene(folder, document)[0].resolve() == work / "quad.obj"
    (folder.parent / "quad.obj").write_text(QUAD)
    assert find_scene(folder, document)[0].resolve() == folder.parent / "quad.obj"


def test_scene_that_is_told_comes_first_and_must_be_the_same_file(
    made: tuple[Path, dict[str, Any], Path], tmp_path: Path
) -> None:
    folder, document, _ = made
    other = tmp_path / "renamed.obj"
    other.write_text(QUAD)
    assert find_scene(folder, document, scenes=other)[0] == other
    other.write_text(QUAD + "\n")
    with pytest.raises(PlanFolderError, match=r"renamed\.obj: is not the file that .*--scene"):
        find_scene(folder, document, scenes=other)
    with pytest.raises(PlanFolderError, match=r"missing\.obj: no such file.*--scene"):
        find_scene(folder, document, scenes=tmp_path / "missing.obj")


def test_scene_that_changed_is_refused_and_a_good_copy_beside_the_plan_is_taken(
    made: tuple[Path, dict[str, Any], Path],
) -> None:
    folder, document, scene_file = made
    scene_file.write_text(QUAD + "# edited\n")
    with pytest.raises(PlanFolderError, match=r"quad\.obj: has changed since .*--scene"):
        find_scene(folder, document)
    copy = folder.parent / "quad.obj"
    copy.write_text(QUAD)
    assert hashlib.sha256(copy.read_bytes()).hexdigest() == document["scene"]["sha256"]
    assert find_scene(folder, document)[0].resolve() == copy


def test_scene_that_is_nowhere_is_named_with_the_option_to_tell_it(made: tuple[Path, dict[str, Any], Path]) -> None:
    folder, document, scene_file = made
    scene_file.unlink()
    with pytest.raises(PlanFolderError, match=r"its scene quad\.obj is not found .*--scene"):
        find_scene(folder, document)


def test_scene_from_memory_has_no_way_to_it(plan: Plan, tmp_path: Path) -> None:
    assert plan_document(plan, tmp_path)["source"] is None
