"""The library's folder: its instances come out of their geometry to the byte, and its certificates hold."""

import dataclasses
import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from tlsplan.group import cli
from tlsplib import checker
from tlsplib.catalogue import class_of, entries, make
from tlsplib.gallery import plan_of
from tlsplib.instance import packed, path_of
from tlsplib.library import Library, known_solvers
from tlsplib.page import compared, page, ranking

from planner_core.errors import PlannerError, SceneError

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "docs" / "tlsplib"
GALLERY = ROOT.parent / "shared" / "data" / "agp"
LARGE = "rooms-62-links"
QUICK = ("rooms-01-whole", "rooms-09-links", "rooms-17-zones-links", "rooms-23-classes", "hall-06-links", "offices-13")


def gallery():
    if not GALLERY.exists():
        pytest.skip("the art-gallery set is not here")
    return GALLERY


def test_there_are_a_hundred_instances_and_eighty_in_a_hundred_are_proven_or_within_one_station():
    listed = Library(FOLDER).listed()
    assert list(listed) == [entry.name for entry in entries()]
    assert len(listed) >= 100
    near = [name for name, told in listed.items() if told["bound"] >= told["stations"] - 1]
    assert len(near) >= 0.8 * len(listed)


def test_the_folder_is_small_and_holds_nothing_of_the_art_gallery_set():
    files = [path for path in FOLDER.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    assert max(path.stat().st_size for path in files) < 2**20
    assert sum(path.stat().st_size for path in files) < 4 * 2**20
    kept = list((FOLDER / "instances").iterdir())
    assert {path.name.removesuffix(".json.xz") for path in kept} == {e.name for e in entries() if e.is_kept}
    assert max(path.stat().st_size for path in kept) < 100_000
    assert not [path for path in kept if path.name.startswith("gallery")]


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_an_instance_comes_out_of_its_geometry_to_the_byte(name):
    [entry] = [entry for entry in entries() if entry.name.startswith(name)]
    kept = checker.unpacked(path_of(FOLDER / "instances", entry.name).read_bytes())
    assert make(entry).raw == kept


@pytest.mark.campaign
def test_all_instances_come_out_of_their_geometry_to_the_byte():
    """But large ones, which the test of all certificates makes."""
    listed = Library(FOLDER).listed()
    for entry in entries():
        is_here = entry.is_kept or (entry.needs_gallery and GALLERY.exists())
        if entry.scan is None and is_here and listed[entry.name]["class"] != "large":
            instance = make(entry, gallery=GALLERY)
            assert instance.sha256 == listed[entry.name]["sha256"], entry.name
            assert class_of(instance) == listed[entry.name]["class"]


@pytest.mark.campaign
def test_scans_made_anew_are_those_that_are_kept():
    listed = Library(FOLDER).listed()
    for entry in entries():
        if entry.scan is not None and entry.scan.scene in ("house", "stairwell", "corridor-comb"):
            assert make(entry).sha256 == listed[entry.name]["sha256"], entry.name


def test_instances_of_the_art_gallery_set_come_out_of_its_files():
    library = Library(FOLDER, gallery())
    for entry in entries():
        if entry.name in ("gallery-general-40-20-whole", "gallery-simple-40-5-links"):
            assert library.instance(entry).sha256 == library.listed()[entry.name]["sha256"]


@pytest.mark.slow
@pytest.mark.parametrize("raw", [b"", b"\xfd7zXZ\x00", b"<a/>", b"<!DOCTYPE a><a/>", b"<graphml/>"])
def test_files_that_are_not_of_the_set_are_refused(tmp_path, raw):
    path = tmp_path / "simple_40_5.graphml.xz"
    path.write_bytes(packed(raw) if raw.startswith(b"<") else raw)
    with pytest.raises(SceneError, match="get"):
        plan_of(path, unit_cm=100)


@pytest.mark.slow
def test_quick_certificates_hold():
    found = list(Library(FOLDER).check(QUICK))
    assert len(found) == len(QUICK)
    assert all(stations >= bound for _, stations, bound in found)


@pytest.fixture(scope="module")
def large():
    """The text of a large instance, made anew, and its certificate."""
    [entry] = [entry for entry in entries() if entry.name == LARGE]
    raw = checker.unpacked(path_of(FOLDER / "certificates", LARGE).read_bytes())
    return Library(FOLDER).instance(entry).raw, json.loads(raw)


@pytest.mark.slow
def test_the_certificate_of_a_large_instance_holds_by_prices_of_rows(large):
    raw, certificate = large
    told = Library(FOLDER).listed()[LARGE]
    assert told["class"] == "large"
    assert checker.check(raw, json.dumps(certificate).encode()) == (LARGE, told["stations"], told["bound"])
    assert "rows" in [cut[0] for cut in certificate["cuts"]]


@pytest.mark.slow
def test_falsified_bounds_of_a_large_instance_are_refused(large):
    raw, certificate = large
    assert certificate["bound"] < len(certificate["plan"])
    at = next(k for k, cut in enumerate(certificate["cuts"]) if cut[0] == "rows")

    def with_shares(share):
        cuts = list(certificate["cuts"])
        cuts[at] = ["rows", cuts[at][1], [share(v) for v in cuts[at][2]]]
        return {"cuts": cuts}

    [[bits, prices, branch]] = certificate["tree"]
    dearer = [v if place % 2 == 0 else v + v // 8 for place, v in enumerate(prices)]
    for false in (
        {"bound": certificate["bound"] + 1},
        with_shares(lambda v: 256),
        with_shares(lambda v: v // 2),
        with_shares(lambda v: min(256, v + 16)),
        {"tree": [[bits, dearer, branch]]},
        {"tree": [[bits, [], branch]]},
    ):
        with pytest.raises(checker.RefusedError):
            checker.check(raw, json.dumps(certificate | false).encode())


@pytest.mark.campaign
def test_all_certificates_hold():
    library = Library(FOLDER, GALLERY if GALLERY.exists() else None)
    assert len(list(library.check(()))) + library.n_left_out(()) == len(entries())


def copied(tmp_path, *names):
    """A library of some instances alone."""
    listed = Library(FOLDER).listed()
    for part in ("instances", "certificates"):
        (tmp_path / part).mkdir()
        for name in names:
            shutil.copy(path_of(FOLDER / part, name), tmp_path / part)
    (tmp_path / "library.json").write_text(json.dumps({name: listed[name] for name in names}))
    return Library(tmp_path)


def test_a_changed_instance_and_a_changed_list_are_told(tmp_path):
    library = copied(tmp_path, "rooms-01-whole", "rooms-02-whole")
    listed = library.listed()
    listed["rooms-01-whole"]["bound"] -= 1
    (tmp_path / "library.json").write_text(json.dumps(listed))
    with pytest.raises(PlannerError, match=r"as in library\.json"):
        list(library.check(("rooms-01-whole",)))
    other = path_of(tmp_path / "instances", "rooms-02-whole")
    shutil.copy(path_of(tmp_path / "instances", "rooms-01-whole"), other)
    with pytest.raises(SceneError, match="of digest"):
        list(library.check(("rooms-02-whole",)))
    path_of(tmp_path / "certificates", "rooms-01-whole").unlink()
    with pytest.raises(PlannerError, match="got no certificate"):
        list(library.check(("rooms-01-whole",)))


@pytest.mark.slow
def test_solving_goes_on_where_it_ended(tmp_path):
    name = "rooms-03-whole"
    library = copied(tmp_path, name)
    path_of(tmp_path / "certificates", name).unlink()
    told = []
    library.solve((name,), ["greedy", "large", "proven"], again=False, tell=told.append)  # it is a small one
    assert [line.split(": ")[1] for line in told] == ["greedy", "proven", "certificate"]
    assert [entry[0] for entry in library.check((name,))] == [name]
    told.clear()
    library.solve((name,), ["greedy", "proven"], again=False, tell=told.append)
    assert told == []
    library.solve((name,), ["greedy"], again=True, tell=told.append)
    assert [line.split(": ")[1] for line in told] == ["greedy"]


def test_names_that_fit_nothing_are_told():
    with pytest.raises(SceneError, match="fits none"):
        list(Library(FOLDER).check(("castle",)))
    with pytest.raises(SceneError, match="not known"):
        known_solvers(["oracle"])


def test_commands_write_check_and_rank(tmp_path):
    def run(*words):
        done = CliRunner().invoke(cli, ["tlsplib", *words, "--library", str(FOLDER)], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return done.output

    assert "1 written, 0 already there" in run("generate", "rooms-01", "-o", str(tmp_path))
    assert "0 written, 1 already there" in run("generate", "rooms-01", "-o", str(tmp_path))
    assert (
        path_of(tmp_path, "rooms-01-whole").read_bytes() == path_of(FOLDER / "instances", "rooms-01-whole").read_bytes()
    )
    assert "1 certificates hold, 1 plans are proven" in run("check", "rooms-01")
    assert "left out" in run("check", "gallery-simple-40-5")
    assert {line.split()[0] for line in run("rank", "rooms-0").splitlines()[1:]} >= {"proven", "greedy"}
    with pytest.raises(SceneError, match=r"no library\.json"):
        CliRunner().invoke(cli, ["tlsplib", "check", "--library", str(tmp_path)], catch_exceptions=False)


def test_the_page_is_that_of_the_results():
    library = Library(FOLDER)
    assert (FOLDER / "results.md").read_text(encoding="utf-8") == page(library.listed(), library.results())


def test_a_ranking_counts_what_was_found_where_all_were_run():
    listed = {f"a{i}": {"class": "small", "links": 0, "stations": 5, "bound": 5} for i in range(3)}
    found = {"stations": 5, "bound": 5, "valid": True, "cpu_s": 2.0}
    results = {name: {"proven": found} for name in listed}
    results["a0"]["greedy"] = found | {"stations": 6, "bound": 0, "cpu_s": 1.0}
    results["a1"]["greedy"] = found | {"valid": False, "bound": 0, "cpu_s": 4.0}
    header, rows = ranking(listed, results)
    assert dict(zip(header, rows[0], strict=True)) == {
        "solver": "proven", "plans": "2", "best": "2", "proves": "2", "stations more": "0.00", "CPU time, ours 1": "1",
    }  # fmt: skip
    assert rows[1] == ["greedy", "1", "0", "0", "1.00", "1.2"]


def test_a_solver_of_one_class_leaves_those_of_others_compared():
    listed = {
        name: {"class": name[:5], "links": 0, "stations": 5, "bound": 5} for name in ("small", "large-1", "large-2")
    }
    found = {"stations": 5, "bound": 5, "valid": True, "cpu_s": 2.0}
    results = {name: {"proven": found} for name in listed}
    results["large-1"]["large"] = found
    assert compared(listed, results) == ["small", "large-1"]


def test_entries_are_told_apart_by_all_that_they_are_made_from():
    every = entries()
    assert len({entry.name for entry in every}) == len(every)
    assert len({str(dataclasses.replace(entry, name="")) for entry in every}) == len(every)
