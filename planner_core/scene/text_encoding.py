"""In which code page the names in a file are: older programs write their own country's, and no format states which.

UTF-8 if the bytes are valid as such. Else an East Asian code page, if nearly all of its characters would be common
ones: each has a first level with the characters in use, and bytes of another code page rarely fall into it. Else
Cyrillic, if most letters are not ASCII; else Western European. (charset-normalizer, tried on lists of storey names,
takes Chinese ones for Korean and German ones for Czech.)
Sources: JIS X 0208, GB 2312, Big5 and KS X 1001, as in Python's codecs.
"""

from __future__ import annotations

from collections.abc import Callable

_COMMON_SHARE = 0.8
"""Share of an East Asian code page's characters that have to be common ones."""
_FEW = 6
"""Characters below which Chinese goes before Korean: both put common characters at the same places, Korean at fewer."""


def _is_common_japanese(lead: int, trail: int) -> bool:
    return 0x81 <= lead <= 0x83 or 0x87 <= lead <= 0x97


def _is_common_korean(lead: int, trail: int) -> bool:
    return (0xA1 <= lead <= 0xA3 or 0xB0 <= lead <= 0xC8) and trail >= 0xA1


def _is_common_simplified(lead: int, trail: int) -> bool:
    return (0xA1 <= lead <= 0xA3 or 0xB0 <= lead <= 0xD7) and trail >= 0xA1


def _is_common_traditional(lead: int, trail: int) -> bool:
    return 0xA1 <= lead <= 0xC6


_EAST_ASIAN: dict[str, Callable[[int, int], bool]] = {
    "cp949": _is_common_korean,
    "cp932": _is_common_japanese,
    "gbk": _is_common_simplified,
    "big5": _is_common_traditional,
}
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
