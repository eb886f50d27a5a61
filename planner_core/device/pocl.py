"""What PoCL, OpenCL for processors, needs before it can be used: a processor's name it knows, and a linker.

THE PROCESSOR'S NAME. PoCL compiles with the LLVM that it was built with, and asks it for the processor's name. A
processor that came later is called `generic` there, and clang refuses that name: no kernel builds (PoCL issue 1049).
The PoCL that pyopencl brings is of 2022 (LLVM 14). It takes AMD's Zen 4, which came next, for Zen 3, which lacks
AVX-512. So where it is `generic`, or Zen 3 of a processor with AVX-512, and only there, the name is replaced by that
of the x86-64 level whose instructions the processor has, before anything is built.

PoCL has no call for that; the name is a pointer in its device structure, whose place is known for the versions in
`_NAME_OFFSETS`. Nothing is written unless version, triple and name are found just as that version lays them out; they
are read through the operating system (`/proc/self/mem`), which answers a wild address with an error, not a crash.
Whether kernels compute rightly then is found out in a child process before any is used (`planner_core.device.check`).

References
----------
x86-64 levels: System V ABI, AMD64 supplement, "micro-architecture levels". LLVM knows them as processors since 12.
"""

from __future__ import annotations

import ctypes
import platform
import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from planner_core.operating_system import own_memory, processor_flags

#: Name of PoCL's platform, in every version.
POCL = "Portable Computing Language"
_UNKNOWN = "generic"
#: What LLVM 14 calls Zen 4.
_WITHOUT_AVX512 = "znver3"
_TRIPLE = "x86_64-unknown-linux-gnu"
#: By PoCL's version: where the device structure keeps `char *llvm_target_triplet` and `char *llvm_cpu`, in bytes.
_NAME_OFFSETS = {"3.0-rc2": (632, 640)}
_VERSION = re.compile(r"\bPoCL (\S+)")
#: Instructions of each level beyond those of the one before, as /proc/cpuinfo names them, which lists what the
#: operating system lets programs use.
_LEVELS = (
    ("x86-64", "fpu cx8 cmov mmx fxsr sse sse2"),
    ("x86-64-v2", "cx16 lahf_lm popcnt pni ssse3 sse4_1 sse4_2"),
    ("x86-64-v3", "avx avx2 bmi1 bmi2 f16c fma abm movbe xsave"),
    ("x86-64-v4", "avx512f avx512bw avx512cd avx512dq avx512vl"),
)
HIGHEST_LEVEL = _LEVELS[-1][0]
"""The x86-64 level with AVX-512."""
_LIBRARY_ROOTS = ("/usr/lib", "/usr/lib64", "/lib64")

#: Devices that were named here, by address: name given.
_named: dict[int, str] = {}


def name_processor(device: Any) -> None:
    """Give a PoCL device whose compiler does not know this processor, or all of it, the name of its x86-64 level.

    Does nothing where the name is another, where the layout is not recognised, and on other systems.
    """
    pointer = _name_pointer(device)
    found = "" if pointer is None else _text_at(_word_at(pointer))
    if pointer is None or found not in (_UNKNOWN, _WITHOUT_AVX512):
        return
    name = level_of(processor_flags())
    if name is None or (found == _WITHOUT_AVX512 and name != HIGHEST_LEVEL):
        return
    # As PoCL made its own: it may free it at the end.
    ctypes.c_void_p.from_address(pointer).value = _strdup(name)
    _named[int(device.int_ptr)] = name


def name_given(device: Any) -> str | None:
    """Return the name that `name_processor` gave a device; None where it left it alone."""
    return _named.get(int(device.int_ptr))


def level_of(flags: Iterable[str]) -> str | None:
    """Return the highest x86-64 level whose instructions are all among a processor's flags; None: not even the first.

    >>> level_of("fpu cx8 cmov mmx fxsr sse sse2 avx512f".split())
    'x86-64'
    """
    there, best = frozenset(flags), None
    for name, needed in _LEVELS:
        if not there.issuperset(needed.split()):
            break
        best = name
    return best


def linker_problem() -> str:
    """Return why PoCL can't link kernels here, or nothing.

    PoCL 3.0 calls the system's linker for every kernel it compiles and aborts the whole process where that fails, so
    the linker and the two libraries it needs have to be searched for beforehand.
    """
    compiler = any(shutil.which(name) for name in ("cc", "gcc", "clang"))
    libgcc = any(path.is_file() for root in _LIBRARY_ROOTS for path in Path(root).glob("gcc/*/*/libgcc.a"))
    libc = any(
        path.exists() for root in _LIBRARY_ROOTS for path in (Path(root, "libc.so"), *Path(root).glob("*/libc.so"))
    )
    if shutil.which("ld") and (compiler or (libgcc and libc)):
        return ""
    return (
        "PoCL links its kernels with the system's linker and C library, which are not here; "
        "run `apt-get install gcc libc6-dev`"
    )


def _name_pointer(device: Any) -> int | None:
    """Address of the pointer to the processor's name; None where the structure is not laid out as we know it."""
    version = _VERSION.search(str(device.platform.version))
    offsets = _NAME_OFFSETS.get(version[1]) if version else None
    if offsets is None or platform.system() != "Linux" or platform.machine() != "x86_64":
        return None
    triple, name = (int(device.int_ptr) + offset for offset in offsets)
    return name if _text_at(_word_at(triple)) == _TRIPLE else None


def _word_at(address: int) -> int:
    """Eight bytes of this process's memory as an address; 0 where nothing is mapped."""
    return int.from_bytes(own_memory(address, 8), "little")


def _text_at(address: int) -> str:
    """Text that ends with a zero byte; empty where nothing is mapped or it is not ASCII."""
    return own_memory(address, 64).partition(b"\0")[0].decode("ascii", errors="ignore") if address else ""


def _strdup(text: str) -> int:
    function = ctypes.CDLL(None).strdup
    function.restype, function.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    copy: int | None = function(text.encode("ascii"))
    if copy is None:
        raise MemoryError("no memory for a processor's name")
    return copy
