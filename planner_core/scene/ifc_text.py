"""The text of an IFC file, before IfcOpenShell reads it: unpacked, checked, and its names put into ASCII.

IfcOpenShell 0.9 reads a file that is cut off without a word, ends the whole process on a shape with an end that is not
there, and leaves out bytes that are not ASCII. Source: ISO 10303-21:2016 (strings: 6.4.3).

Older programs write their own country's code page, and no format states which. UTF-8 if the bytes are valid as such.
Else an East Asian code page, if nearly all of its characters would be common ones: each has a first level with the
characters in use, and bytes of another code page rarely fall into it. Else Cyrillic, if most letters are not ASCII;
else Western European. (charset-normalizer, tried on lists of storey names, takes Chinese ones for Korean and German
ones for Czech.) Sources: JIS X 0208, GB 2312, Big5 and KS X 1001, as in Python's codecs.
"""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from planner_core.errors import SceneError, grouped, one_line, reason_of
from planner_core.scene.raw import what_it_looks_like

MAX_UNPACKED_BYTES = 2 * 1024**3
"""Longest IFC file in an archive: IfcOpenShell needs several times as much memory."""
_MOST_TIMES, _LEAST_UNPACKED_BYTES = 50, 32 * 1024**2
"""An archive's file is at most this many times as long as the archive, or this long: IFC shrinks to a tenth, files of
repeated parts to a thirtieth; blanks and comments, which nobody needs, to a thousandth."""
_HIGH = rb"\\S\\(?:'(?:'(?![\s,)]))?|[^'])"
"""The sign 128 above an ASCII one; an apostrophe is doubled in the standard, and mostly not in files."""
_TEXT = re.compile(rb"'(?:" + _HIGH + rb"|[^'\\]|\\|'')*+'|/\*.*?\*/", re.DOTALL)
"""Strings and comments, whichever begins first: either may hold the signs that begin the other."""
_DEFINITION = re.compile(rb"#(\d{1,18})\s*=")
_REFERENCE = re.compile(rb"#(\d{1,18})")
_INSTANCE = re.compile(rb"#(\d{1,18})\s*=\s*(\w+)\s*\(([^;]*)")
_SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'")
_SHAPE_SLOTS, _UNIT_SLOTS = slice(5, 7), slice(7, None)
"""Attributes of IfcProduct: ObjectPlacement, Representation; of IfcProject: RepresentationContexts, UnitsInContext."""
_TOO_OLD = ("IFC2X_", "IFC2X2", "IFC20", "IFC15")
_XML = "the model as .ifc again from the program that made it, or convert it, such as with the free xbim Xplorer"
# ------------------------------------------------------------------------------------------------- syntax
_TOKEN = re.compile(
    rb"(?P<blank>\s+|/\*.*?\*/)|(?P<value>'(?:[^'\\]|\\|'')*'|#\d+|[$*]|\.\w+\.|\"[0-9A-Fa-f]*\""
    rb"|[+-]?(?:\d+\.\d*(?:[Ee][+-]?\d+)?|\d+)(?![\w.]))|(?P<word>!?[A-Za-z_]\w*)|(?P<mark>[(),;=])",
    re.DOTALL,
)
_WORD_THERE = re.compile(rb"[^\s,();=']+|.", re.DOTALL)
_STEPS = {
    ("#", "#"): "=", ("=", "="): "name", ("name", "word"): "(", ("name", "("): "value", ("(", "("): "value",
    ("value", "value"): "next", ("value", "word"): "(", ("value", "("): "value", ("value", ")"): "close",
    ("next", ","): "another", ("next", ")"): "close", ("another", "value"): "next", ("another", "word"): "(",
    ("another", "("): "value", (";", ";"): "#",
}  # fmt: skip
"""What is expected, and what stands there -> what is expected next."""
_CONTROL = re.compile(rb"\\X\\[89][0-9A-Fa-f]")
_BYTE = re.compile(rb"\\\\|\\X\\([0-9A-Fa-f]{2})|(" + _HIGH + rb")")
"""A backslash itself; a byte by its number; a byte by the sign 128 below it."""
_ESCAPE = re.compile(rb"\\\\|\\S\\.|\\P[A-I]\\|\\X\\[0-9A-Fa-f]{2}|\\X[24]\\(?:[0-9A-Fa-f]{4})+\\X0\\|(\\)", re.DOTALL)
"""An escape of a string; or a backslash that begins none, as in paths that programs write as they are."""
_NOT_ASCII = re.compile(r"[^\x00-\x7f]+")
_COMMON_SHARE = 0.8
"""Share of an East Asian code page's characters that have to be common ones."""
_FEW = 6
"""Characters below which Chinese goes before Korean: both put common characters at the same places, Korean at fewer."""
_TITLES = {
    "utf-8": "UTF-8",
    "cp949": "Korean (code page 949)",
    "cp932": "Japanese (Shift-JIS)",
    "gbk": "simplified Chinese (GBK)",
    "big5": "traditional Chinese (Big5)",
    "cp1251": "Cyrillic (Windows-1251)",
    "cp1252": "Western European (Windows-1252)",
    "latin-1": "Western European (Latin-1)",
}


@dataclass(frozen=True)
class LostEnd:
    """An instance that names one that is not in the file."""

    instance: int
    kind: str
    missing: int

    def __str__(self) -> str:
        return f"#{self.instance} ({self.kind}) names #{self.missing}"


# ------------------------------------------------------------------------------------------------- file
def read_text(path: Path) -> tuple[bytes, bool]:
    """Text of an IFC file; whether it was in a zip archive (.ifczip).

    Raises
    ------
    SceneError
        Not an IFC file, one in XML, of a schema that is too old, cut off, or an archive of none, several or too much.
    """
    with path.open("rb") as file:
        start = file.read(256)
    is_packed = start.startswith(b"PK\x03\x04")
    text = _unpacked(path) if is_packed else path.read_bytes()
    _check_is_complete(path, text)
    schema = _SCHEMA.search(text[:100_000])
    named = schema.group(1).decode("ascii", "replace").upper() if schema else ""
    if named == "IFC2X" or named.startswith(_TOO_OLD):
        raise SceneError(
            f"{path.name}: it is {one_line(named)}, a schema of before 2006, expected IFC2X3, IFC4 or IFC4X3; open it "
            "in the program that made it, or in one that still reads it, and export it as IFC2X3."
        )
    return text, is_packed


def _unpacked(path: Path) -> bytes:
    """The one IFC file in an archive."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = [m for m in archive.infolist() if PurePosixPath(m.filename).suffix.lower() in (".ifc", ".ifcxml")]
            names = [m for m in members if not m.filename.startswith("__MACOSX/")]
            if len(names) != 1:
                found = ", ".join(one_line(m.filename) for m in names[:3])
                raise SceneError(
                    f"{path.name}: the archive has {grouped(len(names))} IFC files{f' ({found})' if names else ''}, "
                    "expected one; unpack it and name the file to load."
                )
            limit = min(MAX_UNPACKED_BYTES, max(_LEAST_UNPACKED_BYTES, _MOST_TIMES * path.stat().st_size))
            with archive.open(names[0]) as member:  # the size stated in the archive may be false
                text = member.read(limit + 1)
    # `zipfile` raises NotImplementedError where it does not know an archive's compression.
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError) as error:
        reason = reason_of(error)
        raise SceneError(
            f"{path.name}: the archive can't be unpacked ({reason}); copy it again, or unpack it by hand."
        ) from error
    if len(text) > limit:
        raise SceneError(
            f"{path.name}: the file in it is longer than {limit / 1024**2:.0f} MiB, which is not unpacked of an "
            f"archive of {path.stat().st_size / 1024**2:.1f} MiB; unpack it and name the .ifc file."
        )
    return text


def _check_is_complete(path: Path, text: bytes) -> None:
    """An IFC file marks its beginning and end."""
    start = text[:256].removeprefix(b"\xef\xbb\xbf").lstrip()
    if start.startswith(b"<") and (b"ifcxml" in text[:4096].lower() or path.suffix.lower() == ".ifcxml"):
        raise SceneError(f"{path.name}: it is ifcXML, which is not read, expected the text form; export {_XML}.")
    if not start.startswith((b"ISO-10303-21", b"/*")):
        raise SceneError(
            f"{path.name}: not an IFC file: {what_it_looks_like(start)}, expected ISO-10303-21 in its first line; "
            "export the model as IFC again."
        )
    if b"END-ISO-10303-21" not in text[-4096:]:
        raise SceneError(f"{path.name}: it has no END-ISO-10303-21 at its end: it is cut off; copy or export it again.")


# ----------------------------------------------------------------------------------------------- lost ends
def without_strings(text: bytes) -> bytes:
    """The text with an empty string for each string, and a blank for each comment."""
    if b"/*" not in text:
        return _TEXT.sub(b"''", text)
    return _TEXT.sub(lambda match: b"''" if match.group().startswith(b"'") else b" ", text)


def lost_ends(bare: bytes, product_ids: set[int]) -> tuple[list[LostEnd], list[LostEnd]]:
    """Instances that name a missing one: those that a shape needs, and the others.

    bare : the text `without_strings`. product_ids : the IfcProducts whose shapes are wanted. Needed is what they name
    as placement and representation, what that names, and so on, and the project's units and contexts.
    """
    present = {int(n) for n in _DEFINITION.findall(bare)}
    if {int(n) for n in _REFERENCE.findall(bare)} <= present:
        return [], []
    names: dict[int, list[int]] = {}
    kinds: dict[int, str] = {}
    first_named: dict[int, list[int]] = {}
    for word, kind, attributes in _INSTANCE.findall(bare):
        number = int(word)
        names[number], kinds[number] = [int(n) for n in _REFERENCE.findall(attributes)], kind.decode()
        if kind == b"IFCPROJECT" or number in product_ids:
            slots = attributes.split(b",")[_UNIT_SLOTS if kind == b"IFCPROJECT" else _SHAPE_SLOTS]
            first_named[number] = [int(n) for n in _REFERENCE.findall(b" ".join(slots))]
    shape: set[int] = set()
    stack = [number for named in first_named.values() for number in named]
    while stack:
        number = stack.pop()
        if number not in shape:
            shape.add(number)
            stack += names.get(number, ())
    needed: list[LostEnd] = []
    others: list[LostEnd] = []
    for number, named in names.items():
        for missing in (n for n in named if n not in present):
            ends = needed if number in shape or missing in first_named.get(number, ()) else others
            ends.append(LostEnd(number, kinds[number], missing))
    return needed, others


def syntax_fault(text: bytes) -> str:
    """The first place in the data of a file that is no STEP, in words: line, instance, what stands there; empty: none.

    An instance is `#1=NAME(values);`, and values are separated by commas, lists of them in parentheses.
    """
    at = max(0, text.find(b"DATA;")) + len(b"DATA;")
    end = max(text.rfind(b"ENDSEC;"), at)
    instance, depth, wanted = "", 0, "#"
    while at < end:
        token = _TOKEN.match(text, at)
        kind = "" if token is None else str(token.lastgroup)
        found = b"" if token is None else token.group()
        if kind != "blank":
            step = _STEPS.get((wanted, "#" if wanted == "#" and found.startswith(b"#") else _kind(kind, found)))
            if step is None or (step == "close" and depth == 0):
                return _fault_in_words(text, at, instance)
            if wanted == "#":
                instance = found.decode()
            depth += (found == b"(") - (found == b")")
            wanted = _after(step, depth)
        assert token is not None  # what is none was a fault
        at = token.end()
    return "" if wanted == "#" else _fault_in_words(text, end, instance)


def _kind(group: str, found: bytes) -> str:
    return found.decode() if group == "mark" else group


def _after(step: str, depth: int) -> str:
    if step != "close":
        return step
    return "next" if depth else ";"


def _fault_in_words(text: bytes, at: int, instance: str) -> str:
    start = at
    while start > 0 and at < len(text) and _part_of_word(text[start - 1]) and _part_of_word(text[at]):
        start -= 1
    there = _WORD_THERE.match(text, start)
    token = one_line(there.group().decode("utf-8", "replace"))[:40] if there else ""
    line = text.count(b"\n", 0, at) + 1
    return f"line {grouped(line)}{f', {instance}' if instance else ''}: {token!r} is no STEP syntax"


def _part_of_word(byte: int) -> bool:
    return chr(byte).isalnum() or chr(byte) in "#+-._"


# -------------------------------------------------------------------------------------------------- names
def with_ascii_names(text: bytes) -> tuple[bytes, str]:
    r"""The same text with `\X2\` for what is not ASCII in its strings, and a phrase: which code page that was in.

    Some programs escape the bytes of their code page one by one (`\X\8A`), which is for ISO 8859 alone: bytes that are
    no letters there give them away. The phrase is empty where nothing is amiss; the text is then the same.
    """
    end = text.find(b"DATA;")  # the header may be of another program: paths, as the system has them
    header, phrase = _with_ascii_names(text[: max(0, end)])
    data, phrase_of_data = _with_ascii_names(text[max(0, end) :])
    if not phrase and not phrase_of_data:
        return text, ""
    return header + data, phrase_of_data or phrase


def _with_ascii_names(text: bytes) -> tuple[bytes, str]:
    escaped = _CONTROL.search(text) is not None
    if text.isascii() and not escaped:
        return text, ""
    meant = _bytes_meant if escaped else bytes
    foreign = [string for string in map(meant, _strings(text)) if not string.isascii()]
    if not foreign:
        return text, ""
    encoding = encoding_of(foreign)

    def in_ascii(match: re.Match[bytes]) -> bytes:
        found = match.group()
        string = meant(found) if found.startswith(b"'") else found
        if string.isascii() or not found.startswith(b"'"):
            return found
        decoded = string.decode(encoding)
        return _NOT_ASCII.sub(_escaped, decoded.replace("\\", r"\\") if string != found else decoded).encode("ascii")

    return _TEXT.sub(in_ascii, text), encoding_title(encoding)


def _bytes_meant(string: bytes) -> bytes:
    """The bytes of a string whose escapes stand for bytes; the very string where some stand for characters."""
    return string if b"\\X2\\" in string or b"\\X4\\" in string else _BYTE.sub(_byte, string)


def _byte(match: re.Match[bytes]) -> bytes:
    if match.group(1):
        return bytes.fromhex(match.group(1).decode())
    return bytes([match.group(2)[3] | 0x80]) if match.group(2) else b"\\"


def with_doubled_backslashes(text: bytes) -> bytes:
    """The same text with backslashes that begin no escape as characters of their strings."""

    def doubled(match: re.Match[bytes]) -> bytes:
        return _ESCAPE.sub(lambda found: rb"\\" if found.group(1) else found.group(), match.group())

    return _TEXT.sub(doubled, text)


def _strings(text: bytes) -> Iterator[bytes]:
    return (found for found in _TEXT.findall(text) if found.startswith(b"'"))


def _escaped(match: re.Match[str]) -> str:
    r"""Characters as ISO 10303-21 writes them: `\X4\` for all where one is beyond 16 bits, else `\X2\`."""
    found = match.group()
    if max(found) > "\uffff":
        return rf"\X4\{found.encode('utf-32-be').hex().upper()}\X0" + "\\"
    return rf"\X2\{found.encode('utf-16-be').hex().upper()}\X0" + "\\"


# ----------------------------------------------------------------------------------------------- code pages
def _is_common_japanese(lead: int, trail: int) -> bool:
    return 0x81 <= lead <= 0x83 or 0x87 <= lead <= 0x97


def _is_common_korean(lead: int, trail: int) -> bool:
    return (0xA1 <= lead <= 0xA3 or 0xB0 <= lead <= 0xC8) and trail >= 0xA1


def _is_common_simplified(lead: int, trail: int) -> bool:
    return (0xA1 <= lead <= 0xA3 or 0xB0 <= lead <= 0xD7) and trail >= 0xA1


def _is_common_traditional(lead: int, trail: int) -> bool:
    return 0xA1 <= lead <= 0xC6


def encoding_of(texts: list[bytes]) -> str:
    """Name, as Python's, of a code page in which all `texts` of one file can be read."""
    together = b"\n".join(texts)
    if _can_be(together, "utf-8"):
        return "utf-8"
    best, best_share = "", 0.0
    for name, is_common in _EAST_ASIAN.items():
        if not _can_be(together, name):
            continue
        n_common, n_all = _n_common(together.decode(name), name, is_common)
        share = n_common / n_all if n_all else 0.0
        if name == "cp949" and n_all < _FEW:
            share -= 1e-6
        if share > best_share:
            best, best_share = name, share
    if best_share >= _COMMON_SHARE:
        return best
    n_foreign = sum(byte >= 0xC0 for byte in together)
    n_ascii = sum(chr(byte).isascii() and chr(byte).isalpha() for text in texts if not text.isascii() for byte in text)
    if n_foreign > n_ascii and _can_be(together, "cp1251"):
        return "cp1251"
    return "cp1252" if _can_be(together, "cp1252") else "latin-1"


def encoding_title(name: str) -> str:
    """What `encoding_of`'s answer is called in a message."""
    return _TITLES[name]


def _can_be(text: bytes, encoding: str) -> bool:
    try:
        text.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _n_common(text: str, encoding: str, is_common: Callable[[int, int], bool]) -> tuple[int, int]:
    """Common ones among the characters of two bytes, and how many those are."""
    pairs = [pair for pair in (char.encode(encoding) for char in text if not char.isascii()) if len(pair) == 2]
    return sum(is_common(pair[0], pair[1]) for pair in pairs), len(pairs)


_EAST_ASIAN: dict[str, Callable[[int, int], bool]] = {
    "cp949": _is_common_korean,
    "cp932": _is_common_japanese,
    "gbk": _is_common_simplified,
    "big5": _is_common_traditional,
}
