"""Certificates: the checker takes those that hold, of plans and bounds that trying all sets confirms, and no others."""

import copy
import json
import lzma
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_instances import fewest, meets, tiny
from tlsplib import checker
from tlsplib.instance import Instance, Need, from_raw, packed
from tlsplib.plans import Survey, instance_of, rooms
from tlsplib.proof import certify, rows_cuts

CHECKER = Path(checker.__file__)


def text_of(certificate):
    return json.dumps(certificate, separators=(",", ":")).encode("ascii")


@given(seed=st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_certified_plans_are_the_smallest_by_trying_all_sets(seed):
    instance = tiny(seed)
    best = fewest(instance)
    certificate = certify(instance, list(range(instance.n_candidates)))
    assert meets(instance, certificate["plan"]), seed
    assert checker.check(instance.raw, text_of(certificate)) == ("tiny", len(best), len(best)), seed


@pytest.mark.slow
@given(seed=st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_no_bound_above_the_fewest_stations_is_taken(seed):
    """Whatever the tree: the true one with the bound raised, and with any of its numbers changed."""
    instance = tiny(seed)
    best = fewest(instance)
    plan = list(range(instance.n_candidates))
    if len(best) == len(plan):
        return
    certificate = certify(instance, best) | {"plan": plan, "bound": len(best) + 1}
    with pytest.raises(checker.RefusedError):
        checker.check(instance.raw, text_of(certificate))
    rng = np.random.default_rng(seed)
    for _ in range(5):
        changed = copy.deepcopy(certificate)
        shaken(changed, rng)
        with pytest.raises(checker.RefusedError):
            checker.check(instance.raw, text_of(changed))


def shaken(certificate, rng):
    """Change a number of a cut or of the tree, in place."""
    places = []

    def find(some):
        for key, value in enumerate(some):
            if type(value) is int:
                places.append((some, key))
            elif isinstance(value, list):
                find(value)

    find(certificate["cuts"])
    find(certificate["tree"])
    some, key = places[rng.integers(len(places))]
    some[key] = int(rng.choice([0, some[key] + 1, some[key] * 2, 2**40, 255]))


@given(seed=st.integers(0, 10**6), n_shares=st.integers(1, 6))
@settings(max_examples=25, deadline=None)
def test_cuts_hold_for_every_set_that_meets_everything(seed, n_shares):
    instance = tiny(seed, twice=True)
    problem = checker.Instance(instance.raw)
    rng = np.random.default_rng(seed)
    shares = {int(i): int(rng.integers(0, 257)) for i in rng.permutation(instance.n_candidates)[:n_shares]}
    whole = range(2**instance.n_candidates)
    sets = [[i for i in range(instance.n_candidates) if mask >> i & 1] for mask in whole[1:]]
    sets = [chosen for chosen in sets if meets(instance, chosen)]
    cuts = []
    for k, need in enumerate(instance.needs):
        of_rows = np.minimum(rng.integers(0, 512, size=int(need.rows.sum())), 256).tolist()
        for kind, told in (("cover", [v for pair in shares.items() for v in pair]), ("rows", of_rows)):
            try:
                cuts.append(problem.cut(kind, k, told))
            except checker.RefusedError:
                continue
    between = [int(i) for i in np.flatnonzero(rng.random(instance.n_candidates) < 0.4)]
    for paid in ([], [0], [0, 1]):
        try:
            cuts.append(problem.cut("links", between, paid))
        except checker.RefusedError:
            continue
    for coefficients, right in cuts:
        for chosen in sets:
            assert sum(coefficients.get(i, 0) for i in chosen) >= right, (seed, chosen)


@pytest.mark.slow
@given(seed=st.integers(0, 10**6))
@settings(max_examples=8, deadline=None)
def test_prices_of_rows_alone_prove_no_more_than_the_fewest_stations(seed):
    instance = tiny(seed, n=8, n_rows=20)
    best = fewest(instance)
    certificate = certify(instance, best, most_nodes=0, root_limit_s=0.0, work_limit=0.01)
    assert checker.check(instance.raw, text_of(certificate))[1:] == (len(best), certificate["bound"]), seed
    assert 1 <= certificate["bound"] <= len(best), seed


@pytest.mark.slow
def test_prices_of_rows_prove_what_the_relaxation_has():
    """Of twelve stations that see a row each, alone, any plan of all but one row needs eleven."""
    sees = np.eye(12, dtype=bool)
    told = [("all", sees.any(axis=0), 1100), ("half", np.arange(12) < 6, 600)]
    needs = tuple(Need(title, rows, required, 1) for title, rows, required in told)
    instance = Instance("eye", "tiny", {}, np.zeros((12, 3), int), np.full(12, 100), sees, needs, None)
    [*cuts] = rows_cuts(instance, n_stations=12, work_limit=0.1)
    assert {name[0] for _, name in cuts} == {"rows"}
    certificate = certify(instance, list(range(11)), most_nodes=0, root_limit_s=0.0, work_limit=0.1)
    assert certificate["bound"] == 11
    assert {cut[0] for cut in certificate["cuts"]} == {"rows"}


@pytest.fixture(scope="module")
def instance():
    plan = rooms(3, width=1000, depth=900, largest_m2=25)
    return instance_of("a-flat", "rooms", {}, plan, Survey(grid=150, most=800, overlap=25))


@pytest.fixture(scope="module")
def certificate(instance):
    found = certify(instance, list(range(instance.n_candidates)))
    assert len(found["plan"]) == found["bound"] > 2
    return found


def test_instances_are_read_as_they_were_written(instance):
    again = from_raw(instance.raw)
    assert again.raw == instance.raw
    assert again.sha256 == checker.Instance(instance.raw).digest


def refusal(instance_raw, certificate_raw):
    with pytest.raises(checker.RefusedError) as caught:
        checker.check(instance_raw, certificate_raw)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.slow
def test_a_bound_raised_by_one_is_refused(instance, certificate):
    assert refusal(instance.raw, text_of(certificate | {"bound": certificate["bound"] + 1})).startswith("bound")
    spare = next(i for i in range(instance.n_candidates) if instance.is_solved_by(sorted({*certificate["plan"], i})))
    if spare in certificate["plan"]:
        spare = next(
            i
            for i in range(instance.n_candidates)
            if i not in certificate["plan"] and instance.is_solved_by([*certificate["plan"], i])
        )
    larger = certificate | {"plan": [*certificate["plan"], spare], "bound": certificate["bound"] + 1}
    assert "may hold a plan of fewer" in refusal(instance.raw, text_of(larger))


def test_wrong_plans_are_refused(instance, certificate):
    plan = certificate["plan"]
    for wrong, told in (
        (plan[:-1], "misses a constraint"),
        ([*plan, plan[0]], "twice"),
        ([], "misses a constraint"),
        ([*plan[:-1], instance.n_candidates], "expected 0 to"),
        ([*plan[:-1], -1], "expected 0 to"),
        ([*plan[:-1], True], "expected 0 to"),
        ([*plan[:-1], str(plan[-1])], "expected 0 to"),
    ):
        assert told in refusal(instance.raw, text_of(certificate | {"plan": wrong})), wrong


def test_a_disconnected_plan_is_refused(instance, certificate):
    cut = instance.links.copy()
    alone = certificate["plan"][0]
    cut[alone] = cut[:, alone] = False
    apart = type(instance)(**{**fields(instance), "links": cut})
    told = certificate | {"sha256": apart.sha256}
    assert "not connected" in refusal(apart.raw, text_of(told))


def fields(instance):
    return {name: getattr(instance, name) for name in instance.__dataclass_fields__}


def test_changed_weights_are_refused_with_and_without_the_digest_of_them(instance, certificate):
    heavier = type(instance)(**{**fields(instance), "ticks": instance.ticks // 2 + 1})
    assert "sha256 differs" in refusal(heavier.raw, text_of(certificate))
    need = instance.needs[0]
    less = Need(need.title, need.rows, need.required // 2)
    easier = type(instance)(**{**fields(instance), "needs": (less,)})
    told = refusal(easier.raw, text_of(certificate | {"sha256": easier.sha256}))
    assert "may hold a plan of fewer" in told or "a piece will do alone" in told


def test_a_one_sided_link_is_refused(instance, certificate):
    links = instance.links.copy()
    i, j = np.argwhere(links)[0]
    links[i, j] = False
    odd = type(instance)(**{**fields(instance), "links": links})
    assert "one-sided" in refusal(odd.raw, text_of(certificate | {"sha256": odd.sha256}))


def test_trees_that_leave_something_out_are_refused(instance, certificate):
    group = [0, *range(instance.n_candidates // 2)]
    leaf = certificate["tree"][-1]
    for tree, told in (
        ([], "has no node"),
        (certificate["tree"][:-1], "has no node"),
        ([*certificate["tree"], leaf], "not as in the format"),
        ([[0, [], None]], "may hold a plan of fewer"),
        ([[0, [], group], leaf], "has no node"),
        ([[0, [], [1]]], "no candidates"),
        ([[0, [], [0, 3, 3]]], "no candidates"),
        ([[0, [10**6, 1], None]], "expected 0 to"),
        ([[0, [0, -1], None]], "expected 0 to"),
        ([[0, [0], None]], "not as in the format"),
        ([[99, [0, 1], None]], "expected 0 to"),
    ):
        assert told in refusal(instance.raw, text_of(certificate | {"tree": tree})), tree


def test_branches_on_groups_count_as_they_say():
    """Two of three stations are needed: a branch on how many of both proves 2, and none of the kind proves 3."""
    need = Need("whole", np.ones(2, dtype=bool), 20)
    sees = np.array([[1, 0], [0, 1], [0, 0]], dtype=bool)
    both = Instance("both", "tiny", {}, np.zeros((3, 3), dtype=np.int64), np.array([10, 10]), sees, (need,))
    told = {"format": "tlsplib certificate 1", "sha256": both.sha256, "plan": [0, 1], "cuts": [["cover", 0, []]]}
    # The cut is (x_0 + x_1) / 2 >= 1, row 1 the branch; prices are whole stations.
    good = told | {"bound": 2, "tree": [[0, [], [1, 0, 1]], [0, [0, 20, 1, 10], None], [0, [1, 1], None]]}
    assert checker.check(both.raw, text_of(good)) == ("both", 2, 2)
    for most in (0, 1, 2, 3):
        tree = [[0, [], [most, 0, 1]], [0, [0, 20, 1, 10], None], [0, [1, 10], None]]
        assert refusal(both.raw, text_of(told | {"plan": [0, 1, 2], "bound": 3, "tree": tree}))


def test_false_cuts_are_refused(instance, certificate):
    everybody = [v for i in range(instance.n_candidates) for v in (i, 256)]
    for cut, told in (
        (["cover", 0, everybody], "its rows alone"),
        (["cover", 7, [0, 256]], "expected 0 to"),
        (["cover", 0, [0, 300]], "expected 0 to"),
        (["cover", 0, [0]], "not as in the format"),
        (["rows", 0, [0] * len(instance.ticks)], "its rows alone"),
        (["rows", 0, [256]], "not as in the format"),
        (["rows", 0, [257] * len(instance.ticks)], "expected 0 to 256"),
        (["rows", 7, []], "expected 0 to"),
        (["links", [], []], "a piece will do alone"),
        (["links", [0], [0]], "in between"),
        (["links", [], [0, 1]], "holds both"),
        (["links", [], [0, 1, 2]], "no links, or one in between"),
        (["hearsay", 0, []], "another kind"),
    ):
        assert told in refusal(instance.raw, text_of(certificate | {"cuts": [cut]})), cut


def test_damaged_files_are_refused_in_one_line(instance, certificate):
    good, whole = text_of(certificate), packed(text_of(certificate))
    bomb = lzma.compress(b" " * 2**20)
    for damaged in (
        b"",
        b"[]",
        b"null",
        b"\xff\xfe",
        good[:-40],
        whole[:-40],
        whole[:60] + bytes(8) + whole[68:],
        whole + b"more",
        bomb,
        b"[" * 100_000,
        good.replace(b'"bound":', b'"bound":NaN,"b":'),
        good.replace(b'"bound":', b'"bound":-Infinity,"b":'),
        good.replace(b'"bound":', b'"bound":1e3,"b":'),
        good.replace(b'"bound":', b'"bound":2.0,"b":'),
        good.replace(b'"bound":', b'"bound":' + b"9" * 100_000 + b',"b":'),
        good.replace(b'"bound":', b'"bound":[1],"b":'),
        good.replace(b'"tree":', b'"trees":'),
        good.replace(b'"cuts":', b'"cuts":null,"c":'),
        good.replace(b"certificate 1", b"certificate 2"),
    ):
        assert damaged != good
        assert refusal(instance.raw, damaged)


def test_damaged_instances_are_refused_in_one_line(instance, certificate):
    told = json.loads(instance.raw)
    for change in (
        {"ticks": [-1, *told["ticks"][1:]]},
        {"ticks": told["ticks"][:-1]},
        {"sees": ["-1", *told["sees"][1:]]},
        {"sees": ["f" * 10_000, *told["sees"][1:]]},
        {"sees": [7, *told["sees"][1:]]},
        {"constraints": []},
        {"constraints": [told["constraints"][0] | {"seen_from": 0}]},
        {"constraints": [told["constraints"][0] | {"seen_from": 10**9}]},
        {"constraints": [told["constraints"][0] | {"required": 0}]},
        {"links": told["links"][:-1]},
    ):
        assert refusal(json.dumps(told | change).encode(), text_of(certificate))


@pytest.mark.slow
def test_the_checker_is_a_file_of_200_lines_that_runs_alone(instance, certificate, tmp_path):
    assert len(CHECKER.read_text(encoding="utf-8").splitlines()) <= 200
    files = tmp_path / "a.json.xz", tmp_path / "b.json"
    files[0].write_bytes(packed(instance.raw))
    files[1].write_bytes(text_of(certificate))
    alone = tmp_path / "checker.py"
    alone.write_bytes(CHECKER.read_bytes())

    def run(*paths):
        command = [sys.executable, "-I", "-S", str(alone), *map(str, paths)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    k = certificate["bound"]
    done = run(*files)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"a-flat: {k} stations, at least {k}\n", "")
    files[1].write_bytes(text_of(certificate | {"bound": 0}))
    for paths in (files, files[:1], (files[0], tmp_path / "nothing.json")):
        done = run(*paths)
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr.startswith("refused: ")
        assert done.stderr.count("\n") == 1
