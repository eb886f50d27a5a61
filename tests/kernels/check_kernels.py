"""`make kernel-check`: every kernel under oclgrind, as CPUs and as GPUs run them, and on poisoned memory.

    python tests/kernels/check_kernels.py

1. The checker is shown a kernel that writes out of bounds, one that races and one that reads what nobody wrote: it must
   report all three.
2. All kernels, in packets of eight and of one: no invalid access, no data race. Those of one as on a GPU: work-groups
   as large as the NDRange allows, up to 256, and a device of the memory that GPUs have at least.
3. No use of uninitialised variables, in packets of four and of one. Without the kernels that build the tree, and with
   all memory of the device written to: oclgrind 21.10 dies of those kernels and of packets of eight here, and takes
   what one kernel wrote for uninitialised in the next.
4. So for the device's memory: all kernels on the machine's own device, with unwritten memory full of one byte, then of
   another. The results must be the same.

Every kernel of kernels/*.cl has to be launched in 2, and all results have to be the same, bit by bit, throughout. Exit
code 1 where anything is reported.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

HERE = Path(__file__).resolve().parent
CHECKER = "oclgrind"
#: Bytes that make huge, negative and not-a-number of whatever they are read as; and small ones.
POISONS = ("0xff", "0x01")
RACES, UNINITIALISED = "--data-races", "--uninitialized"
#: The least that GPUs in use have: 32 KiB of local memory, 64 KiB for constants, work-groups of 256.
LIKE_A_GPU = (
    "--local-mem-size",
    "32768",
    "--constant-mem-size",
    "65536",
    "--max-wgsize",
    "256",
    "--compute-units",
    "64",
)


@dataclass(frozen=True)
class Run:
    """What one run came to."""

    kernels: frozenset[str]
    results: str
    report: str
    """What is wrong; empty where nothing is."""


def run(
    arguments: list[str], *, flags: tuple[str, ...] | None, folder: Path, program: str = "exercise_kernels.py"
) -> Run:
    """Run a program of this folder, under oclgrind with `flags`, or as it is where they are None."""
    log = folder / "oclgrind.log"
    log.unlink(missing_ok=True)
    command = [sys.executable, str(HERE / program), *arguments]
    environment = {name: value for name, value in os.environ.items() if name != "TLSPLAN_DEVICE"}
    if flags is not None:
        # Without optimisation: LLVM makes intrinsics of it that oclgrind 21.10 does not know. No cache: pyopencl would
        # hand on programs built with other options.
        checker = [CHECKER, *flags, "--build-options", "-cl-opt-disable", "--max-errors", "50", "--log", str(log)]
        command = [*checker, *command]
        environment["PYOPENCL_NO_CACHE"] = "1"
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=1800, env=environment)
    report = log.read_text(encoding="utf-8", errors="replace").strip() if log.exists() else ""
    said = done.stdout.strip().splitlines()
    if done.returncode != 0 or not said or "OCLGRIND" in done.stderr:
        ended = f"ended with {done.returncode}: {done.stderr.strip()[-2000:]}"
        return Run(frozenset(), "", f"{report}\n{ended}".strip())
    document = json.loads(said[-1])
    return Run(frozenset(document["kernels"]), document["results"], report)


def missed_faults(folder: Path) -> list[str]:
    """Faults on purpose that oclgrind does not report here: then its silence elsewhere means nothing."""
    expected = {
        ("out-of-bounds", RACES): "Invalid write of size 4",
        ("race", RACES): "data race",
        ("uninitialised", UNINITIALISED): "uninitialized value",
        ("none", RACES): "",
        ("none", UNINITIALISED): "",
    }
    missed = []
    for (fault, flag), words in expected.items():
        report = run([fault], flags=(flag,), folder=folder, program="faulty_kernels.py").report
        if words.lower() not in report.lower() or bool(words) != bool(report):
            missed.append(f"{fault} with {flag}: expected a report of {words!r}, got {report[:500]!r}")
    return missed


def all_kernels() -> frozenset[str]:
    """Names of the kernels in kernels/*.cl."""
    sources = (f for f in resources.files("planner_core.kernels").iterdir() if f.name.endswith(".cl"))
    return frozenset(
        name
        for source in sources
        for name in re.findall(r"^(?:__)?kernel\s+void\s+(\w+)", source.read_text(encoding="utf-8"), flags=re.M)
    )


def passes(folder: Path) -> list[tuple[str, list[str], tuple[str, ...] | None]]:
    """All runs: title, arguments, flags."""
    tree = str(folder / "tree.npz")
    plan: list[tuple[str, list[str], tuple[str, ...] | None]] = [("cpu, as it is", ["cpu", "--save-tree", tree], None)]
    for form in ("cpu", "gpu"):
        device = LIKE_A_GPU if form == "gpu" else ()
        plan.append((f"{form}, accesses and races", [form], (RACES, *device)))
        plan += [(f"{form}, unwritten memory full of {byte}", [form, "--poison", byte], None) for byte in POISONS]
    plan.append(("cpu-16, accesses and races", ["cpu-16"], (RACES,)))
    for form in ("cpu-4", "gpu"):
        written = ["--tree", tree, "--poison", POISONS[0]]
        plan.append((f"{form}, uninitialised variables", [form, *written], (UNINITIALISED,)))
    return plan


def main() -> int:
    if shutil.which(CHECKER) is None:
        print(f"{CHECKER} is not here: `make kernel-check` installs it, or `apt-get install {CHECKER}`")
        return 1
    wrong = []
    with tempfile.TemporaryDirectory(prefix="tlsplan-kernel-check-") as name:
        folder = Path(name)
        wrong += missed_faults(folder)
        launched: set[str] = set()
        results: dict[str, str] = {}
        for title, arguments, flags in passes(folder):
            found = run(arguments, flags=flags, folder=folder)
            state = "clean" if not found.report else "REPORTED"
            print(f"{title:<42} {len(found.kernels):>3} kernels  {found.results}  {state}", flush=True)
            if found.report:
                wrong.append(f"{title}:\n{found.report[:4000]}")
            elif flags and RACES in flags:
                launched |= found.kernels
            results[title] = found.results
        if len(set(results.values())) > 1:
            wrong.append(f"results differ: {results}")
        never = all_kernels() - launched
        if never:
            wrong.append(f"never launched, so not checked: {', '.join(sorted(never))}; exercise_kernels.py has to")
    for text in wrong:
        print(f"\n{text}")
    print("\nkernel check:", "FAILED" if wrong else f"all {len(launched)} kernels are clean")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
