"""Files of requirements: what they say, what follows from all, and what is refused, with the entry named."""

import json
import math
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tlsplan import inputs
from tlsplan.options import RequirementOptions

from planner_core.errors import RequirementError
from planner_core.model import LinkLimits, PartRequirement, PointLimits, PreAlignment, Requirements, Scope, Site
from planner_core.requirements.read import read_requirements, requirements_from
from planner_core.requirements.yaml_or_json import MOST_BYTES
from planner_core.scanner.load_scanner import load_scanner

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = (DOCS / "formats" / "requirements.md", DOCS / "howto" / "requirements.md")
SCHEMA = json.loads((DOCS / "formats" / "requirements.schema.json").read_text(encoding="utf-8"))

FULL = """
coverage: 95 %
spacing: 6 mm
range: 20 m
incidence: 65 deg
noise: 2 mm
seen_from: 2
reflectivity: 60 %
overlap: 25 %
network: loops
link_strength: 0.02
planned_floors: [Level 1, F2]
floors:
  Level 1: {coverage: 98 %, noise: any}
  F2: 80 %
classes:
  IfcWall*: {spacing: 3 mm, seen_from: 3, floors: Level 1}
  "*column*": 99 %
zones:
  - name: plant room
    outline: [[0, 0], [4, 0], [4, 3.5 m], [0, 3.5], [0, 0]]
    heights: [0.5, 2]
    range: 10 m
  - {classes: [IfcDoor, IfcWindow], floors: [F2], incidence: any}
site:
  entrances: [[1.0, 2, 0]]
  robot: {radius: 0.3}
"""


def written(folder: Path, text: str | bytes, name: str = "asked.yaml") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return path


def refused(folder: Path, text: str | bytes, name: str = "asked.yaml") -> str:
    with pytest.raises(RequirementError) as caught:
        read_requirements(written(folder, text, name))
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 500
    return message


def test_a_file_says_what_its_words_say(tmp_path: Path) -> None:
    found, site = read_requirements(written(tmp_path, FULL))
    sixty_five = 65 * math.pi / 180
    all_of_it = PointLimits(spacing_m=0.006, range_m=20.0, incidence_rad=sixty_five, noise_m=0.002)
    assert found == Requirements(
        coverage=0.95,
        overlap=0.25,
        floors=("Level 1", "F2"),
        limits=all_of_it,
        seen_from=2,
        reflectivity=0.6,
        network="redundant",
        min_strength=0.02,
        parts=(
            PartRequirement("Level 1", 0.98, PointLimits(0.006, 20.0, sixty_five), 2, floors=("Level 1",)),
            PartRequirement("F2", 0.8, all_of_it, 2, floors=("F2",)),
            PartRequirement(
                "IfcWall*",
                0.95,
                PointLimits(0.003, 20.0, sixty_five, 0.002),
                3,
                floors=("Level 1",),
                classes=("IfcWall*",),
            ),
            PartRequirement("*column*", 0.99, all_of_it, 2, classes=("*column*",)),
            PartRequirement(
                "plant room",
                0.95,
                PointLimits(0.006, 10.0, sixty_five, 0.002),
                2,
                zone=((0, 0), (4, 0), (4, 3.5), (0, 3.5)),
                heights_m=(0.5, 2.0),
            ),
            PartRequirement(
                "zone 2",
                0.95,
                PointLimits(0.006, 20.0, None, 0.002),
                2,
                floors=("F2",),
                classes=("IfcDoor", "IfcWindow"),
            ),
        ),
    )
    assert site == Site(entrances_m=((1.0, 2.0, 0.0),), carrier_radius_m=0.3)


def test_json_says_the_same_as_yaml(tmp_path: Path) -> None:
    import yaml

    as_json = written(tmp_path, json.dumps(yaml.safe_load(FULL)), "asked.json")
    assert read_requirements(as_json) == read_requirements(written(tmp_path, FULL))
    # JSON is YAML, too.
    assert read_requirements(written(tmp_path, as_json.read_bytes())) == read_requirements(as_json)


def test_entries_in_place_of_the_file_s_own_are_followed_by_its_parts(tmp_path: Path) -> None:
    path = written(tmp_path, FULL)
    found, _ = read_requirements(path, instead={"spacing": "10 mm", "network": "none", "coverage": "90 %"})
    expected, _ = read_requirements(
        written(
            tmp_path,
            FULL.replace("\nspacing: 6 mm", "\nspacing: 10 mm")
            .replace("loops", "none")
            .replace("\ncoverage: 95 %", "\ncoverage: 90 %"),
            "other.yaml",
        )
    )
    assert found == expected
    assert found.parts[0].limits.spacing_m == 0.01
    assert found.parts[2].limits.spacing_m == 0.003


def test_entries_in_place_of_the_file_s_own_are_blamed_on_the_options(tmp_path: Path) -> None:
    path = written(tmp_path, "range: 20 m")
    assert read_requirements(path, instead={"Seen-From": 2})[0].seen_from == 2
    for wrong, message in (({"spacing": 6}, "^options: spacing: got 6"), ({"spacng": 6}, "^options: got the unknown")):
        with pytest.raises(RequirementError, match=message):
            read_requirements(path, instead=wrong)


def test_nothing_said_is_the_default() -> None:
    assert requirements_from({}) == (Requirements(), Site())
    assert requirements_from({"spacing": None, "floors": None, "site": None}) == (Requirements(), Site())


@pytest.mark.parametrize("key", ["seen_from", "seen-from", "Seen from", "SEEN_FROM"])
def test_capitals_spaces_and_hyphens_of_entries_do_not_matter(key: str) -> None:
    assert requirements_from({key: 3})[0].seen_from == 3


def test_a_byte_order_mark_is_no_part_of_the_first_entry(tmp_path: Path) -> None:
    assert read_requirements(written(tmp_path, b"\xef\xbb\xbfcoverage: 90 %"))[0].coverage == 0.9


def test_names_are_text_as_written(tmp_path: Path) -> None:
    text = "floors: {01: 90 %, no: 91 %, 1e3: 92 %, 'null': 93 %, 2026-01-01: 94 %}\nplanned_floors: [02, no, 1:30]"
    found, _ = read_requirements(written(tmp_path, text))
    assert [part.name for part in found.parts] == ["01", "no", "1e3", "null", "2026-01-01"]
    assert found.floors[1:] == ("no", "1:30")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("spacng: 6 mm", "asked.yaml: got the unknown entry 'spacng', expected a known one; did you mean spacing?"),
        ("floors: {Level 1: {coverge: 98 %}}", "floors.Level 1: got the unknown entry 'coverge'.*mean coverage?"),
        ("floors: {Level 1: {overlap: 30 %}}", "floors.Level 1: got the unknown entry 'overlap'"),
        ("xyzzy: 1", "known are coverage, spacing, range"),
        ("floors: {Level 1: {coverage: 0.98 %}}", "floors.Level 1.coverage: got '0.98 %'"),
        ("zones: [{name: a, outline: [[0,0],[1,1],[1,0],[0,1]]}]", r"zones\[0\].outline: .*sides 1 and 3"),
        (
            "zones: [{name: a, outline: [[0,0],[1,1],[1,0,2]]}]",
            r"zones\[0\].outline\[2\]: got 3 of them, expected at most 2",
        ),
        ("zones: [{name: a, outline: [[0,0],[1,1]]}]", "got an outline of 2 corners, expected 3 to 10000"),
        ("zones: [{name: a, outline: [[0,0],[1,1],[0,0]]}]", "got an outline of 2 corners"),
        ("zones: [{name: a, outline: [[0,0],[1,0],[1,1],[1,0]]}]", "corners that all differ"),
        ("zones: [{name: a, outline: [[0,0],[1,0],[1,east]]}]", r"zones\[0\].outline\[2\]\[1\]: got 'east'"),
        ("zones: [{name: a, outline: [[0,0],[1,2],[2,4]]}]", r"zones\[0\].outline: got .*around some area"),
        ("zones: [{name: a, outline: [[6e5,6e5],[600001,6e5],[6e5,600000.00019]]}]", "outline: got .*around some area"),
        ("zones: [{name: a, spacing: 3 mm}]", r"zones\[0\]: got a zone of no extent"),
        ("zones: [{heights: [2, 1]}]", r"zones\[0\]: requirement 'zone 1': heights: got 2.0 to 1.0"),
        ("zones: [{heights: [1]}]", r"zones\[0\].heights"),
        ("zones: {a: {heights: [1, 2]}}", "zones: got .*a list of zones"),
        ("zones: [a]", r"zones\[0\]: got 'a', expected keys with values"),
        ("floors: [Level 1]", "floors: got .*expected keys with values"),
        ("floors: {'': 90 %}", "a name of at most"),
        ("network: no", "network: got 'no', expected one of connected, redundant, none"),
        ("overlap_measure: dice", "overlap_measure: got 'dice', expected one of smaller-share, jaccard; leave it out"),
        ("overlap_of: 3", "overlap_of: got 3, expected one of all-seen, seen-as-required; leave it out"),
        ("seen_from: 0", "seen_from: got 0, expected a whole number from 1"),
        ("planned_floors: []", "planned_floors: got"),
        ("planned_floors: [{a: 1}]", r"planned_floors\[0\]: got {'a': 1}, expected a name"),
        ("site: here", "site: got 'here'"),
        ("floors: {A: 90 %}\nclasses: {A: 90 %}", "requirement 'A': got it twice"),
        ("seen_from: 2\nseen-from: 3", "got seen_from twice"),
        ("coverage: 95 %\ncoverage: 90 %", "line 2: 'coverage' a second time"),
        ("site: {a: 1, a: 2}", "'a' a second time"),
        ("{[1, 2]: 3}", "a name that is a list or mapping"),
        ("a: &x 1\nb: *x", "line 1: an anchor or alias"),
        ("classes: {*wall: 90 %}", "line 1: an anchor or alias; put names that begin with . or & in quotes"),
        ("coverage: !!python/object/apply:os.getcwd []", "line 1: a tag"),
        ("coverage: [1, 2", "line 1: "),
        ("coverage: 95 %\n--- \ncoverage: 90 %", "got .*document"),
        ("- coverage", r"got \['coverage'\], expected entries"),
        ("", "got nothing"),
        ("{}", "got nothing"),
        ("coverage: \x00", "characters that are not text"),
        ("coverage: " + "9" * 5000, "coverage: got|too long"),
        ("coverage: " + "[" * 30 + "]" * 30, "more than 20 lists"),
        ("coverage: " + "[" * 5000, "brackets|line"),
        (b"coverage: \xff", "other than UTF-8 at byte 10"),
        (b"#" * (MOST_BYTES + 1), "a larger file"),
    ],
)
def test_what_is_not_understood_is_refused_with_its_entry(tmp_path: Path, text: str | bytes, message: str) -> None:
    import re

    assert re.search(message.replace("?", "[?]"), refused(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"coverage": "95 %", "coverage": "90 %"}', "'coverage' twice"),
        ('{"coverage": NaN}', "NaN, which is no number"),
        ('{"coverage": 1e999}', "coverage: got inf"),
        ('{"coverage": ' + "9" * 5000 + "}", "too long"),
        ('{"coverage": ' + "[" * 100_000, "brackets"),
        ('{"coverage" 1}', "line 1: Expecting"),
        ("[]", "got nothing"),
    ],
)
def test_json_that_is_not_plain_is_refused(tmp_path: Path, text: str, message: str) -> None:
    assert message in refused(tmp_path, text, "asked.json")


def test_a_file_that_is_not_there_or_no_file_is_refused(tmp_path: Path) -> None:
    for path, message in ((tmp_path / "none.yaml", "no such file"), (tmp_path, "got a folder")):
        with pytest.raises(RequirementError, match=message):
            read_requirements(path)


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused_in_one_line(text: str) -> None:
    try:
        requirements_from({"coverage": text, "spacing": text, "floors": {text: text}})
    except RequirementError as error:
        assert "\n" not in str(error)


def examples() -> list[tuple[str, str]]:
    """Blocks of YAML and JSON of the documentation."""
    found = []
    for page in PAGES:
        kind, block = "", []
        for line in page.read_text(encoding="utf-8").splitlines():
            if line.startswith("```"):
                if kind in ("yaml", "json"):
                    found.append((kind, "\n".join(block)))
                kind, block = (line[3:].strip() or "text", []) if not kind else ("", [])
            else:
                block.append(line)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "text"), examples())
def test_examples_of_the_documentation_are_read_and_fit_the_schema(tmp_path: Path, kind: str, text: str) -> None:
    from planner_core.requirements.yaml_or_json import read_document

    path = written(tmp_path, text, f"asked.{kind}")
    read_requirements(path)
    jsonschema.validate(read_document(path), SCHEMA, cls=jsonschema.Draft202012Validator)


def test_the_documentation_has_examples_of_both_kinds() -> None:
    assert {kind for kind, _ in examples()} == {"yaml", "json"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "entries",
    [
        {"coverage": "0.95 %"},
        {"coverage": 1},
        {"spacing": 6},
        {"incidence": 1.2},
        {"network": "star"},
        {"overlap_measure": "dice"},
        {"overlap_of": "seen"},
        {"seen_from": 0},
        {"spacng": "6 mm"},
        {"floors": {"A": {"overlap": "30 %"}}},
        {"zones": [{"name": "a"}]},
        {"zones": [{"outline": [[0, 0], [1, 1]]}]},
        {"range": "20 furlongs"},
        {"noise": "2 deg"},
    ],
)
def test_the_schema_refuses_what_reading_refuses(entries: dict[str, object]) -> None:
    with pytest.raises(RequirementError):
        requirements_from(entries)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(entries, SCHEMA, cls=jsonschema.Draft202012Validator)


def test_the_schema_is_one() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


def test_scope_and_classes_that_need_not_be_covered() -> None:
    entries = {"scope": "Exterior", "classes": {"IfcSite": "none", "IfcWall*": {"coverage": "none"}}}
    requirements, _ = requirements_from(entries, scope=Scope.AUTO, no_cover=("IfcFurnishingElement", "ifcsite"))
    assert requirements.scope == Scope.EXTERIOR
    assert [(part.name, part.coverage, part.classes) for part in requirements.parts] == [
        ("IfcSite", 0.0, ("IfcSite",)),
        ("IfcWall*", 0.0, ("IfcWall*",)),
        ("IfcFurnishingElement", 0.0, ("IfcFurnishingElement",)),
    ]
    assert requirements_from({}, scope=Scope.AUTO)[0].scope == Scope.AUTO
    assert requirements_from({})[0].scope == Scope.ALL
    with pytest.raises(RequirementError, match=r"scope: got 'inside', expected one of auto, interior, exterior, all"):
        requirements_from({"scope": "inside"})
    with pytest.raises(RequirementError, match="coverage: got 0, expected a fraction above 0"):
        requirements_from({"coverage": "none"})


@pytest.mark.parametrize("word", ["seen-as-required", "Seen as required", "SEEN_AS_REQUIRED"])
def test_a_file_names_its_overlap(word: str) -> None:
    asked, _ = requirements_from({"overlap": "40 %", "Overlap measure": "Jaccard", "overlap-of": word})
    assert asked == Requirements(overlap=0.4, overlap_measure="jaccard", overlap_of="seen-as-required")
    plain, _ = requirements_from({"overlap": "40 %"})
    assert (plain.overlap_measure, plain.overlap_of) == ("smaller-share", "all-seen")


def test_options_name_the_overlap_in_place_of_the_file(tmp_path: Path) -> None:
    path = written(tmp_path, "overlap_measure: jaccard\noverlap_of: seen-as-required")
    asking = RequirementOptions(file=path, overlap_measure="smaller-share")
    found, _ = inputs.requirements_and_site(asking, deliverable="none", scope=Scope.ALL)
    assert (found.overlap_measure, found.overlap_of) == ("smaller-share", "seen-as-required")
    found, _ = inputs.requirements_and_site(
        RequirementOptions(overlap_of="seen-as-required"), deliverable="none", scope=Scope.ALL
    )
    assert found == Requirements(overlap_of="seen-as-required")


def test_what_links_need_is_read_and_follows_the_scanner_where_nobody_says_it() -> None:
    found, _ = requirements_from({"link_probability": "98 %", "pre_alignment": "Manual", "overlap": "30 %"})
    assert (found.link_limits, found.pre_alignment) == (LinkLimits(0.3, 0.01, 0.98), PreAlignment.MANUAL)
    usual, tracked = Requirements(), load_scanner("rtc360")
    assert (usual.link_limits, usual.start_of(tracked)) == (LinkLimits(0.0, 0.01, 0.99), PreAlignment.TRACKED)
    assert found.start_of(tracked) == PreAlignment.MANUAL
    assert usual.start_of(load_scanner("focus-premium-70")) == PreAlignment.MANUAL
    for wrong in ({"link_probability": "100 %"}, {"link_probability": "120 %"}, {"pre_alignment": "hand"}):
        with pytest.raises(RequirementError) as caught:
            requirements_from(wrong)
        assert "\n" not in str(caught.value)
