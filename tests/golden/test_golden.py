"""Golden digests: SHA-256 of what coarse runs of tlsplan write, so that a change of form keeps every byte.

`make golden` runs every case and lists the files that differ from `digests.txt`; `make golden ACCEPT=1` records the
files as they are. The help pages, the schemas and the plan of the box are slow tests, the other cases a campaign.

What differs between machines, or with versions of packages, is left out: PNG pictures, and with them reports have none;
the built viewer; of plan.json the device, times, versions and the engine of the independent check; Open3D's version.
Members of archives count one by one, whatever compressed them.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest
from in_process import Tlsplan
from tlsplan.document_schemas import schema_texts

from planner_core.export.formats import FORMATS
from viewer_web.server.openapi import openapi_text

DIGESTS = Path(__file__).with_name("digests.txt")
DUPLEX = Path(__file__).resolve().parents[3] / "shared" / "data" / "ifc" / "duplex.ifc"
COARSE = "--grid 1.5 --height 1.7 --patch-area 0.5 --coverage 80"
QUICK = f"{COARSE} --effort quick --set work_limit=0.2 --verify 0"
JUDGED = f"{COARSE} --effort quick --set work_limit=0.2 --verify 1000"
PAPER = "--preset paper --method paper --grid 2 --patch-area 1 --set genetic.max_iterations=20 --verify 0"
EXPORTS = (f"export plan -o pack --format {','.join(FORMATS)} --subtract 450000,5430000,0 --max-points 200",
           "export plan -o web --format web")  # fmt: skip
CUBE = [*(f"v {3 + i % 2} {2 + i // 2 % 2} {i // 4}" for i in range(8)),
        "f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]  # fmt: skip
REQUIREMENTS = """
coverage: 80 %
incidence: 70 deg
floors: {F0: 75 %}
classes: {IfcWall*: {coverage: 85 %, seen_from: 2}}
zones:
  - {name: corner, outline: [[0, 0], [3, 0], [3, 3], [0, 3]], heights: [0, 2.5], spacing: 8 mm}
site:
  entrances: [[1, 1, 0]]
  returns: true
  keep_out: [{name: locked room, floor: F0, outline: [[4, 1], [5, 1], [5, 2], [4, 2]]}]
"""
GIVEN = {
    "requirements.yaml": REQUIREMENTS,
    "cube.obj": "\n".join([*CUBE, ""]),
    "stations.csv": "id,x_m,y_m,z_m\nA1,2,2,1.7\nA2,4,3,1.7\n",
    "scanned.csv": "id,x_m,y_m,z_m\nA1,2.1,2,1.7\n",
}
BOX, HOUSE = "scene box -o box.ifc --on-map", "scene house -o house.ifc --on-map"
#: Commands of each case, in a folder with the files of GIVEN.
COMMANDS = {
    "box": (BOX, f"plan box.ifc -o plan {JUDGED}"),
    "demo": (f"demo -o demo {COARSE}",),
    "exports-box": (BOX, f"plan box.ifc -o plan {QUICK}", *EXPORTS),
    "exports-house": (HOUSE, f"plan house.ifc -o plan {QUICK}", *EXPORTS),
    "several-files": (BOX, f"plan box.ifc cube.obj -o plan {QUICK} --up cube.obj=z"),
    "redundant": (HOUSE, f"plan house.ifc -o plan {JUDGED} --network redundant"),
    "time": (HOUSE, f"plan house.ifc -o plan {QUICK} --objective time"),
    "coverage": (HOUSE, f"plan house.ifc -o plan {QUICK} --objective coverage --max-stations 6"),
    "keep": (HOUSE, f"plan house.ifc -o first {QUICK}",
             f"plan house.ifc -o plan {QUICK} --keep first/plan.json --locked stations.csv"),
    "requirements": (HOUSE, f"plan house.ifc -o plan {QUICK} --requirements requirements.yaml"),
    "exterior": ("scene facade -o facade.ifc", f"plan facade.ifc -o plan {QUICK} --scope exterior"),
    "paper": (BOX, f"plan box.ifc -o plan {PAPER}"),
    "greedy": (HOUSE, f"plan house.ifc -o plan {COARSE} --method greedy --verify 0"),
    "evaluate": (HOUSE, f"evaluate house.ifc -o plan --stations stations.csv {COARSE} --verify 1000",
                 "compare plan --stations scanned.csv -o again"),
    "simulate": (HOUSE, "simulate house.ifc --stations stations.csv -o scans --scanner hdl-64e"),
    "duplex": (f"plan duplex.ifc -o plan {QUICK}",),
}  # fmt: skip
SLOW, CAMPAIGN = pytest.mark.slow, pytest.mark.campaign


def texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield help pages and schemas with their names. Pages are of a new process: tests change commands of their own."""
    subprocess.run([sys.executable, "-m", "tlsplan.reference", folder / "cli.md"], check=True, timeout=240)
    for section in (folder / "cli.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        title, _, text = section.partition("\n")
        yield f"help/{title.replace(' ', '-')}", text
    yield from schema_texts().items()
    yield "openapi.json", openapi_text()


def contents(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents of files, and of members of archives, less what differs between machines."""
    for file in sorted(folder.rglob("*")):
        name = file.relative_to(folder).as_posix()
        if not file.is_file() or file.suffix == ".png" or re.search(r"/web/(?!plan/)", f"/{name}"):
            continue
        if zipfile.is_zipfile(file):
            with zipfile.ZipFile(file) as archive:
                for member in archive.namelist():
                    if not member.endswith(".png"):
                        yield f"{name}/{member}", archive.read(member)
        else:
            yield name, file.read_bytes()


def printed(done: subprocess.CompletedProcess[str]) -> str:
    """Return warnings and summary of a command, without its progress."""
    warnings = [line for line in done.stderr.splitlines() if line.startswith("warning: ")]
    return re.sub(r"Open3D [\d.]+", "Open3D", "\n".join([*warnings, done.stdout]))


def forget_machine(plan: Path) -> None:
    """Take out of a plan.json what differs between runs and machines: exports name its SHA-256 and its time."""
    text = re.sub(r"Open3D [\d.]+", "Open3D", plan.read_text(encoding="utf-8"))
    text = re.sub(r'\n  "device": ".*",', '\n  "device": "opencl",', text)
    text = re.sub(r'\n  "(versions|timings_s)": \{[^}]*\}', r'\n  "\1": {}', text)
    plan.write_text(text, encoding="utf-8")
    os.utime(plan, (0, 1_700_000_000))


def check(case: str, found: Iterator[tuple[str, bytes]]) -> None:
    """Compare what was found with the digests recorded of a case, or record it."""
    lines = DIGESTS.read_text(encoding="utf-8").splitlines() if DIGESTS.exists() else []
    recorded = dict(reversed(line.split("  ", 1)) for line in lines)
    before = {name: digest for name, digest in recorded.items() if name.startswith(f"{case}/")}
    now = {f"{case}/{name}": sha256(content).hexdigest()[:16] for name, content in found}
    assert now, f"{case}: no files"
    if "ACCEPT" in os.environ:
        kept = {name: digest for name, digest in recorded.items() if name not in before}
        rows = sorted((kept | now).items())
        DIGESTS.write_text("".join(f"{digest}  {name}\n" for name, digest in rows), encoding="utf-8")
        return
    differing = [f"{'changed' if name in before and name in now else 'gone' if name in before else 'new'}: {name}"
                 for name in sorted(before | now) if before.get(name) != now.get(name)]  # fmt: skip
    if differing:
        pytest.fail("\n".join([*differing, "make golden ACCEPT=1 records the files as they are"]), pytrace=False)


@pytest.mark.slow
def test_help_pages_and_schemas_keep_their_bytes(tmp_path: Path) -> None:
    check("texts", ((name, text.encode()) for name, text in texts(tmp_path)))


@pytest.mark.opencl
@pytest.mark.parametrize("case", [pytest.param(case, marks=SLOW if case == "box" else CAMPAIGN) for case in COMMANDS])
def test_written_files_keep_their_bytes(
    case: str, tlsplan: Tlsplan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if case == "duplex" and not DUPLEX.is_file():
        pytest.skip("duplex.ifc is not beside the repository (../shared/data/ifc)")
    monkeypatch.chdir(tmp_path)
    if case == "duplex":
        shutil.copy(DUPLEX, DUPLEX.name)
    for name, text in GIVEN.items():
        Path(name).write_text(text, encoding="utf-8")
    for number, command in enumerate(COMMANDS[case]):
        done = tlsplan(*command.split())
        assert done.returncode in (0, 7), f"{command}: exit code {done.returncode}\n{done.stderr}"
        Path(f"printed-{number}.txt").write_text(printed(done), encoding="utf-8")
        for plan in Path().rglob("plan.json"):
            forget_machine(plan)
    check(case, contents(tmp_path))


@CAMPAIGN
@pytest.mark.opencl
@pytest.mark.parametrize("processor", ["Prescott", "Haswell"])
def test_linear_algebra_of_another_processor_keeps_the_bytes(processor: str) -> None:
    """OpenBLAS adds in another order on each; what is written must not hang on the last digits."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__, "-k", "written_files"]
    environment = {name: value for name, value in os.environ.items() if name != "ACCEPT"}
    done = subprocess.run(
        command, env=environment | {"OPENBLAS_CORETYPE": processor}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
