"""What must be true of the repository as a whole: locks, licences, what the wheel holds, what stands in files."""

import importlib.metadata
import json
import re
import subprocess
import sys
import zipfile
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).resolve().parents[1]
#: Files that are done; benchmarks are not yet.
DO_NOT_SPEAK = (
    r"(planner_core/|cli/|viewer_web/server/|scenes_synthetic/"
    r"|docs/tlsplib/tlsplib/).*\.py$|docs/(howto/|formats/|method/|decisions/|reference/cli|tlsplib/|)[^/]*\.md$"
    r"|docs/formats/field-pack/"
)
#: Names that are public: of plan.json, `compare --json`, options of before, a BCF comment's seed.
MAY_STAND = (
    r"[.`'\"]asked\b|asked_is_met|alias=\"told\""
    r"|--as-told|said/"
)
LOCKS = sorted((ROOT / "requirements").glob("*.lock"))


def tracked_files() -> list[Path]:
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in listed.split("\0") if name and (ROOT / name).is_file()]


@pytest.mark.parametrize("lock", LOCKS, ids=lambda path: path.name)
def test_python_lock_pins_every_package_with_hashes_and_no_address(lock: Path) -> None:
    text = lock.read_text()
    blocks = re.split(r"\n(?=[A-Za-z0-9])", text)
    pinned = [block for block in blocks if re.match(r"[A-Za-z0-9._\[\]-]+==", block)]
    wanted = [line for line in lock.with_suffix(".in").read_text().splitlines() if line and line[0] not in "#-"]
    assert len(pinned) >= len(wanted) > 0
    assert [block.splitlines()[0] for block in pinned if "--hash=sha256:" not in block] == []
    assert "://" not in text


def test_runtime_lock_is_a_part_of_the_dev_lock() -> None:
    def pins(name: str) -> set[str]:
        return set(re.findall(r"^[A-Za-z0-9._-]+==\S+", (ROOT / "requirements" / name).read_text(), flags=re.M))

    assert pins("runtime.lock") <= pins("dev.lock")


@pytest.mark.parametrize("folder", ["viewer_web", "requirements/node"])
def test_npm_lock_records_no_addresses(folder: str) -> None:
    lock = json.loads((ROOT / folder / "package-lock.json").read_text())
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert packages
    assert [name for name, entry in packages.items() if "resolved" in entry] == []
    assert [name for name, entry in packages.items() if not {"integrity", "link", "inBundle"} & entry.keys()] == []


def test_tracked_files_name_no_package_registry_and_no_path_of_a_machine() -> None:
    # Written in pieces, so that this file does not find itself.
    forbidden = re.compile(
        "|".join(
            ["registry" + r"\.npmjs", "files" + r"\.pythonhosted", "pypi" + r"\.org", "/root" + "/", "/home" + "/[a-z]"]
        )
    )
    hits = []
    for path in tracked_files():
        if path.suffix in {".png", ".usdc", ".glb"}:
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
            if forbidden.search(line):
                hits.append(f"{path.relative_to(ROOT)}:{number}")
    assert hits == []


def test_files_and_programs_do_not_speak() -> None:
    """Files state, warnings report, options are given, requirements are required: in sources, messages, help, pages."""
    words = "told|said|tells|says|asked|looked"
    speaks = re.compile(rf"(?i:(?<![a-z])(un)?({words})(?![a-z]))|(Told|Said|Asked|Looked)(?![a-z])")
    hits = []
    for path in tracked_files():
        name = path.relative_to(ROOT).as_posix()
        if name in {"README.md", "CHANGELOG.md", "CONTRIBUTING.md"} or re.match(DO_NOT_SPEAK, name):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
                if speaks.search(re.sub(MAY_STAND, "", line)):
                    hits.append(f"{name}:{number}: {line.strip()}")
    assert not hits, "write states, reports, given, required or examined instead:\n" + "\n".join(hits)


def test_browser_tests_wait_for_what_they_read() -> None:
    """A page answers when it can: what a browser test reads at once fails on a busy machine and nowhere else."""
    reads = re.compile(r"expect\(await .*\.(is[A-Z]\w+|textContent|count|getAttribute|inputValue|hash)\(.*\)\)[.]")
    hits = []
    for path in sorted((ROOT / "viewer_web" / "e2e").glob("*.e2e.ts")):
        hits += [
            f"{path.name}: {line.strip()}"
            for line in path.read_text(encoding="utf-8").splitlines()
            if reads.search(line)
        ]
    assert not hits, "write `await expect.poll(() => ...)` instead:\n" + "\n".join(hits)


def test_modules_import_one_another_in_no_circle() -> None:
    """Imports inside functions and for type checkers count, too: a circle is one thing that was cut into several."""
    graph = grimp.build_graph("planner_core", cache_dir=None)
    try:
        TopologicalSorter({each: graph.find_modules_directly_imported_by(each) for each in graph.modules}).prepare()
    except CycleError as error:
        pytest.fail(f"modules import each other: {' <- '.join(error.args[1])}")


def test_no_dependency_is_under_the_gpl() -> None:
    runtime = re.findall(r"^([A-Za-z0-9._-]+)==", (ROOT / "requirements" / "runtime.lock").read_text(), flags=re.M)
    under_gpl = []
    for name in runtime:
        try:
            metadata = importlib.metadata.metadata(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # locked for another platform
        licence = f"{metadata.get('License-Expression', '')} {metadata.get('License', '')[:200]}"
        classifiers = [c for c in metadata.get_all("Classifier", []) if c.startswith("License")]
        said = " ".join([licence, *classifiers])
        if re.search(r"(?<!L)(?<!Lesser )(?<!Lesser General Public License )\bA?GPL", said) and " OR " not in said:
            under_gpl.append(name)
    assert under_gpl == []


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    out = tmp_path_factory.mktemp("wheel")
    # `git archive`-like copy: building in the checkout would leave build/ and egg-info behind.
    source = out / "source"
    for path in tracked_files():
        target = source / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(path.read_bytes())
    built = ROOT / "viewer_web" / "dist"
    for path in built.rglob("*"):
        if path.is_file():
            target = source / path.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(source)],
        check=True,
        capture_output=True,
        timeout=240,
    )
    return zipfile.ZipFile(next(out.glob("*.whl")))


@pytest.mark.slow
def test_wheel_puts_no_generic_name_into_site_packages(wheel: zipfile.ZipFile) -> None:
    top = {name.split("/")[0] for name in wheel.namelist()}
    assert {name for name in top if not name.endswith(".dist-info")} == {
        "paper_figures",
        "planner_core",
        "scenes_synthetic",
        "tlsplan",
        "tlsplib",
        "viewer_web",
    }


@pytest.mark.slow
def test_wheel_holds_kernels_scanners_and_the_built_viewer(wheel: zipfile.ZipFile) -> None:
    names = set(wheel.namelist())
    for folder, pattern, inside in [
        ("kernels", "*.cl", "planner_core/kernels"),
        ("planner_core/scanner", "**/*.json", "planner_core/scanner"),
        ("viewer_web/dist", "**/*.*", "viewer_web/dist"),
    ]:
        files = [path.relative_to(ROOT / folder) for path in (ROOT / folder).glob(pattern) if path.is_file()]
        assert files, f"nothing matches {folder}/{pattern}: build the viewer first (`make viewer`)"
        assert [str(f) for f in files if f"{inside}/{f.as_posix()}" not in names] == []


def test_wheel_holds_every_python_module(wheel: zipfile.ZipFile) -> None:
    names = set(wheel.namelist())
    moved = {
        "cli": "tlsplan",
        "kernels": "planner_core/kernels",
        "docs/reproduction/paper_figures": "paper_figures",
        "docs/tlsplib/tlsplib": "tlsplib",
    }
    missing = []
    for path in tracked_files():
        inside = path.relative_to(ROOT).as_posix()
        for folder, package in moved.items():
            if inside.startswith(f"{folder}/"):
                inside = inside.replace(folder, package, 1)
        if path.suffix != ".py" or inside.startswith(("tests/", "viewer_web/e2e/")):
            continue
        if inside not in names:
            missing.append(inside)
    assert missing == []
