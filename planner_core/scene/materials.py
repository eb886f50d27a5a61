"""What a surface does to a beam, by its material in the scene file: returns it, lets it pass, stops it.

Scene stage. Readers come here with names and figures; which of a file's statements counts is the readers' matter, see
docs/formats/materials.md. Names and figures were written for people and renderers, so each rule is a guess, stated at
its function; where a file has nothing of it, a surface returns.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from functools import lru_cache

from planner_core.model import Optics

LEAST_TRANSPARENCY = 0.5
"""From this share of light let through, a surface passes beams. Files say 0.6 (tinted) to 1 of glass."""

MIRROR_METALLIC = 0.95
MIRROR_ROUGHNESS = 0.05
"""A surface at least so metallic and at most so rough is a mirror. Brushed and cast metals are drawn rougher."""


def _each(words: str) -> frozenset[str]:
    return frozenset(words.split())


_GLASS = _each(
    "glass glas glaset glasset glazing pane panes plexiglass perspex "  # English, German, Dutch, Scandinavian
    "glasscheibe glasscheiben glasplatte glasfullung glasfuellung fensterscheibe fensterscheiben glasruit glasrute "
    "verre verres vitrage vitrages vitre vitres cristal cristales "  # French, Spanish
    "vetro vetri vetrata vetrate vetrocamera vidrio vidrios acristalamiento vidro vidros "  # Italian, Spanish, Port.
    "lasi szklo szyba sklo"  # Finnish, Polish, Czech
)
_GLASS_ENDINGS = ("glas", "verglasung", "beglazing")
"""Languages that write compounds as one word: Isolierglas, Dreifachverglasung."""
_MIRROR = _each(
    "mirror mirrors spiegelglas miroir miroirs specchio specchi espejo espejos espelho espelhos spejl speil peili "
    "zrcadlo"
)
_MIRROR_ENDINGS = ("spiegel", "spegel")
_MIRRORED = _each("mirrored silvered verspiegelt verspiegeltes specchiato espejado espelhado")
"""Words that make glass a mirror. Alone they are no material: `chair mirrored` is a copy of a chair."""

_NEITHER = frozenset(["douglas", "wasserspiegel"])
"""Words with an ending of glass or mirrors that mean something else: a fir, the level of water."""

_DULL = _each(
    # Glass whose rough or opaque face returns the beam, though light gets through.
    "frosted satin satined satinated opal opaque opalescent milk milky etched sandblasted translucent obscure spandrel "
    "fritted printed enamelled enameled lacquered painted backpainted channel satiniert satiniertes sandgestrahlt matt "
    "mattiert emailliert bedruckt lackiert depoli sable opalin emaille opaline matte satinato acidato sabbiato "
    "smerigliato opalino satinado esmerilado arenado opaco opaca translucido mate fosco jateado gezandstraald "
    # Things made of glass, or named after it, that are no pane.
    "wool wolle wol fibre fiber fibres fibers fibra fibras faser fasern laine lana lan insulation foam foamed cellular "
    "block blocks brick bricks blok blokken baustein pave paves brique briques mattone mattoni ladrillo ladrillos "
    "bloque bloques tijolo tijolos mosaic mosaik mosaique mosaico tile tiles fliese fliesen plastic polymer polyester "
    "resin epoxy concrete cement gypsum kunststoff beton fabric fleece vlies toile tapete wallpaper ceramic imitation "
    "look effect "
    # What holds a pane or a mirror.
    "bead beads bar bars frame frames rahmen cadre cornice marco holder clamp gasket seal putty"
)
"""Words that, beside one of glass or mirrors, say that the surface returns all the same."""
_DULL_COMPOUNDS = _each(
    "fiberglass fibreglass fiberglas foamglass foamglas schaumglas mattglas matglas milchglas melkglas opalglas "
    "satinglas ornamentglas profilglas profilit glasbaustein glasbausteine glasstein glassteine glassteen vetromattone "
    "vetrocemento"
)
_DULL_BEGINNINGS = ("glaswol", "glasswool", "glasull", "glassull", "glasfaser", "glasvezel", "glasfiber", "glassfiber")

_WORD = re.compile(r"[^\W\d_]+")
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
"""Where `ClearGlass` and `glassPane` are two words."""
_NOT_TAKEN_APART = str.maketrans(
    {"\u0142": "l", "\u0141": "L", "\u00f8": "o", "\u00d8": "O", "\u00e3": "an", "\u00c3": "AN"}
)
"""Letters without an accent to take off; and that of the Portuguese for wool, which else became the article `la`."""
_LONGEST_NAME = 1000
"""Letters of a name that are searched: damage may make a name of a whole file."""


def optics_of_name(name: str) -> Optics | None:
    """Tell from the name of a material, style or category.

    Whole words in the languages of Western and Central Europe count, whatever their case and accents, and compounds
    where languages write them as one word. `Glass`, `Isolierglas`, `double vitrage` pass; `Mirror`, `Wandspiegel`,
    `mirrored glass` stop. Frosted, satin, opal, milk and painted glass returns, for its face scatters; and so do glass
    wool, fibreglass, glass blocks, and what holds a pane.

    Returns
    -------
    What a surface of this material does; None where the name has no word for glass or mirrors.
    """
    return _optics_of_words(name[:_LONGEST_NAME])


@lru_cache(maxsize=4096)
def _optics_of_words(name: str) -> Optics | None:
    words = _words(name) - _NEITHER
    if any(word in _DULL_COMPOUNDS or word.startswith(_DULL_BEGINNINGS) for word in words):
        return Optics.RETURNS
    is_mirror = any(word in _MIRROR or word.endswith(_MIRROR_ENDINGS) for word in words)
    is_glass = any(word in _GLASS or word.endswith(_GLASS_ENDINGS) for word in words)
    if not (is_mirror or is_glass):
        return None
    if words & _DULL:
        return Optics.RETURNS
    return Optics.STOPS if is_mirror or words & _MIRRORED else Optics.PASSES


def _words(name: str) -> frozenset[str]:
    """Words in lower case, without accents."""
    plain = unicodedata.normalize("NFC", _HUMP.sub(" ", name)).translate(_NOT_TAKEN_APART)
    letters = (c for c in unicodedata.normalize("NFKD", plain) if not unicodedata.combining(c))
    return frozenset(_WORD.findall("".join(letters).casefold()))


def optics_of_transparency(transparency: float | None) -> Optics | None:
    """Optics by the share of light that a surface lets through, 0 to 1; None for None and NaN."""
    if transparency is None or transparency != transparency:
        return None
    return Optics.PASSES if transparency >= LEAST_TRANSPARENCY else Optics.RETURNS


def optics_of_metal(metallic: float | None, roughness: float | None) -> Optics | None:
    """Tell from a renderer's figures, each 0 to 1: a smooth metal is a mirror. None where a figure is missing."""
    if metallic is None or roughness is None or metallic != metallic or roughness != roughness:
        return None
    is_mirror = metallic >= MIRROR_METALLIC and roughness <= MIRROR_ROUGHNESS
    return Optics.STOPS if is_mirror else Optics.RETURNS


def optics_of_material(
    names: Iterable[str],
    *,
    transparency: float | None = None,
    metallic: float | None = None,
    roughness: float | None = None,
) -> Optics | None:
    """Combine names and figures of one material; None where they decide nothing.

    The first of `names` with a known word decides: exporters lose figures more often than names, and only a name
    distinguishes frosted glass from clear. Else the figures: passing before mirroring, both before returning.
    """
    for name in names:
        by_name = optics_of_name(name)
        if by_name is not None:
            return by_name
    by_figures = (optics_of_transparency(transparency), optics_of_metal(metallic, roughness))
    for optics in (Optics.PASSES, Optics.STOPS, Optics.RETURNS):
        if optics in by_figures:
            return optics
    return None
