"""The sites file: what it takes is what `tlsplan plan` takes, and a job's key is of all that its plan depends on."""

import json
from pathlib import Path

import jsonschema
import pytest
from tlsplan.batch.jobs import files_of, first_jobs, floor_jobs
from tlsplan.batch.sites_file import OPTIONS, SitesFile, read_sites
from tlsplan.commands.plan import command as plan_command

from planner_core.documents import schema_text
from planner_core.errors import RequirementError
from planner_core.requirements.yaml_or_json import read_document

#: Of `tlsplan plan`, what says where a plan is written, how it is shown, and what scans it.
NOT_OF_A_SITE = {"output", "overwrite", "json", "quiet", "engine", "device", "scheduler", "method_options"}


def written(folder: Path, text: str, **files: str) -> Path:
    for name, content in files.items():
        (folder / name.replace("_", ".")).write_text(content)
    path = folder / "sites.yaml"
    path.write_text(text)
    return path


def test_every_option_that_says_what_is_planned_is_an_entry() -> None:
    longest = {max(option.opts, key=len).lstrip("-").replace("-", "_") for option in plan_command.params[1:]}
    assert set(OPTIONS) == longest - NOT_OF_A_SITE


def test_a_site_overrides_the_defaults(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "defaults: {Max-Range: 20m, grid: 1, floor: [F0, F1], refine: false}\n"
        "sites:\n  - {scene: a.obj, grid: 2ft}\n  - {scene: b.obj, portfolio: north, refine: true}\n",
    )
    (a, b), prices = read_sites(path)
    assert prices is None
    assert (a.name, a.portfolio, b.portfolio) == ("a", "", "north")
    assert set(a.arguments) == {"--max-range=20m", "--grid=2ft", "--floor=F0", "--floor=F1", "--no-refine"}
    assert set(b.arguments) == {"--max-range=20m", "--grid=1", "--floor=F0", "--floor=F1", "--refine"}
    assert a.values["grid_step_m"] == pytest.approx(0.6096)


def test_names_and_words_of_earlier_versions_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, "defaults: {Judge: 0}\nsites:\n  - scene: a.obj\n  - {scene: b.obj, verify: 500}\n")
    (a, b), _ = read_sites(path)
    assert (a.arguments, b.arguments) == (("--verify=0",), ("--verify=500",))
    path.write_text(
        "sites:\n  - {scene: a.obj, doors: shut, door_shut: X}\n  - {scene: b.obj, doors: closed, door_closed: X}\n"
    )
    assert [site.values["doors"] for site in read_sites(path)[0]] == ["closed", "closed"]
    assert [site.values["doors_closed"] for site in read_sites(path)[0]] == [("X",), ("X",)]
    path.write_text("sites: [{scene: a.obj, judge: 0, verify: 500}]")
    with pytest.raises(RequirementError, match="got the unknown entry 'judge', expected a known one"):
        read_sites(path)


def test_a_pattern_is_a_site_for_each_file_and_a_list_one_of_several(tmp_path: Path) -> None:
    path = written(
        tmp_path, "sites:\n  - scene: '*.obj'\n  - scene: [a.ifc, c.ifc]\n  - scene: no*.ply\n  - scene: gone.stl\n"
        "  - scene: models\n",
        b_obj="", a_obj="", a_ifc="", c_ifc="",
    )  # fmt: skip
    with pytest.raises(RequirementError, match=r"sites\[1\]: got a second site a, expected names that differ"):
        read_sites(path)
    path.write_text(path.read_text().replace("c.ifc]", "c.ifc]\n    name: Both of them"))
    (tmp_path / "models").mkdir()
    sites, _ = read_sites(path)
    assert [site.name for site in sites] == ["a", "b", "Both-of-them", "no", "gone", "models"]
    assert [len(site.scenes) for site in sites] == [1, 1, 2, 1, 1, 1]
    assert "no file has such a name" in sites[3].missing
    assert "there is no such file" in sites[4].missing
    assert "it is a folder" in sites[5].missing and "models/*.ifc" in sites[5].missing
    assert [job.name for job in first_jobs(sites)] == ["a", "b", "Both-of-them"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sites: [{scene: a.obj, coverage: 120}]", r"sites\[0\]: Invalid value for '--coverage': 120"),
        ("sites: [{scene: a.obj, coverages: 90}]", r"sites\[0\]: got the unknown entry 'coverages'.*coverage"),
        ("sites: [{scene: a.obj, grid: true}]", r"sites\[0\].grid: got True, expected a text or a number"),
        ("sites: [{scene: a.obj, grid: [1, 2]}]", r"sites\[0\].grid: got \[1, 2\], expected a text or a number"),
        ("sites: [{scene: a.obj, refine: 1}]", r"sites\[0\].refine: got 1, expected true or false"),
        ("sites: [{scene: a.obj, set: [work_limits=1]}]", r"sites\[0\]: .*work_limits"),
        ("sites: [{scene: a.obj, method: greedy, time_limit: 5}]", r"sites\[0\]: --time-limit: got it with"),
        ("sites: [{scene: a.obj, scanner: no-such}]", r"sites\[0\]: scanner: got 'no-such'"),
        ("sites: [{scene: a.obj, requirements: gone.yaml}]", r"sites\[0\]: .*gone.yaml: got no such file"),
        ("sites: [{scene: a.obj, floors: some}]", r"sites\[0\].floors: got 'some'"),
        ("sites: [{scene: '*.obj', name: both}]", r"sites\[0\]: got the name 'both' for 2 files"),
        ("sites: [{name: a}]", r"sites\[0\].*: got no scene"),
        ("sites: []", "sites: got 0 of them, expected at least 1"),
        ("prices: {hour: -1}\nsites: [{scene: a.obj}]", "prices.hour: got -1, expected 0 or more"),
        ("defaults: {scene: a.obj}\nsites: [{scene: a.obj}]", "defaults: got the unknown entry 'scene'"),
        ("", "got nothing, expected entries such as `sites: .*see docs/formats/sites.md"),
    ],
)
def test_what_plan_would_refuse_is_refused_before_anything_begins(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(RequirementError, match=said) as refused:
        read_sites(written(tmp_path, text, a_obj="", b_obj=""))
    assert "\n" not in str(refused.value)


def test_the_schema_takes_the_example_of_the_page(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[3] / "docs" / "formats" / "sites.md"
    path = tmp_path / "sites.yaml"
    path.write_text(page.read_text(encoding="utf-8").partition("```yaml\n")[2].partition("```")[0])
    (tmp_path / "school.yaml").write_text("coverage: 90 %")
    jsonschema.validate(read_document(path), json.loads(schema_text(SitesFile, "x")))
    assert len(read_sites(path)[0]) == 4


def key(path: Path) -> str:
    from tlsplan.batch import jobs

    jobs.digest_of.cache_clear()
    jobs._named_in.cache_clear()
    (job,) = first_jobs(read_sites(path)[0])
    return job.key


def test_a_key_changes_with_files_and_options_and_with_nothing_else(tmp_path: Path) -> None:
    first, second = tmp_path / "one", tmp_path / "two"
    text = "sites: [{scene: a.obj, requirements: asked.yaml, coverage: 90}]"
    files = {"a_obj": "mtllib a.mtl\n", "a_mtl": "newmtl x\n", "b_mtl": "", "asked_yaml": "range: 20 m"}
    paths = []
    for folder in (first, second):
        folder.mkdir()
        paths.append(written(folder, text, **files))
    kept = key(paths[0])
    assert key(paths[1]) == kept, "the same files elsewhere"
    (first / "b.mtl").write_text("a file that nothing names")
    paths[0].write_text("sites: [{coverage: 90.0, requirements: asked.yaml, scene: a.obj, portfolio: x}]")
    assert key(paths[0]) == kept
    seen = {kept}
    for name, content in (("a.obj", "mtllib a.mtl\n#"), ("a.mtl", "newmtl y\n"), ("asked.yaml", "range: 21 m")):
        (first / name).write_text(content)
        seen.add(key(paths[0]))
    paths[0].write_text(paths[0].read_text().replace("90.0", "91"))
    seen.add(key(paths[0]))
    assert len(seen) == 5


def test_files_of_a_site_are_its_scene_what_that_refers_to_and_what_options_name(tmp_path: Path) -> None:
    path = written(
        tmp_path, "sites: [{scene: a.obj, requirements: asked.yaml}]",
        a_obj="mtllib a.mtl\n", a_mtl="", b_mtl="", asked_yaml="range: 20 m",
    )  # fmt: skip
    ((site,), _) = read_sites(path)
    assert [file.name for file in files_of(site)] == ["a.obj", "asked.yaml", "a.mtl"]


def test_storeys_are_jobs_of_their_own_those_alone_that_are_asked_for(tmp_path: Path) -> None:
    ((site,), _) = read_sites(written(tmp_path, "sites: [{scene: a.obj, floors: each, floor: [upper]}]", a_obj=""))
    (finding,) = first_jobs([site])
    assert finding.words(tmp_path)[:1] == ("floors",)
    (upper,) = floor_jobs(site, [("F0", "Ground"), ("F1", "Upper")])
    assert (upper.name, [word for word in upper.words(tmp_path) if "floor" in word]) == ("a-F1", ["--floor=F1"])
