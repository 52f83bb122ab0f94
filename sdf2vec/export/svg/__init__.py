"""SVG that looks like the render wherever it is opened; see docs/svg.md."""

from __future__ import annotations

import base64
import math
import re
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...errors import Sdf2vecError
from ...files import one_line
from ...scene import Scene
from ..options import Options
from .canvas import Canvas, Document, color_text, tag
from .compact import GRAINS, GROUP
from .difference_blend import Term, alternating, terms
from .layers import Detail, Painter, Part, is_banded, is_soft, plan
from .refit_appearance import compensated
from .sampling import extent

PORTABLE = "portable"
CREATED = re.compile(rb"(/CreationDate \(D:)([^)]*)")
DIFFERENCE = "mix-blend-mode:difference"

# From what looks like the render to what is small. Names go last, for they are what a person edits by.
DETAILS = (
    Detail(),
    Detail(target=43.0, levels=0.3),
    Detail(target=40.0, levels=0.5),
    Detail(target=37.0, levels=0.8, coarser=1),
    Detail(target=34.0, levels=1.2, coarser=1),
    Detail(target=30.0, levels=2.0, coarser=1, named=False),
    Detail(target=0.0, levels=4.0, coarser=1, named=False),
    *(Detail(target=0.0, levels=4.0, named=False, lean=grain) for grain in GRAINS),
)


class Written(NamedTuple):
    """A drawing without its title, and what a user should know about it."""

    document: Document
    notes: tuple[str, ...]


def svg(scene: Scene, options: Options) -> str:
    """The scene as SVG text in pixels of the fitted picture.

    An additive scene that the profile or a transparent ground can't hold is fitted again under `over` (`notes` says
    how near that is). Raises Sdf2vecError for a size limit that can't be met.
    """
    return _written(scene, options).document.text(one_line(options.title))


def notes(scene: Scene, options: Options) -> tuple[str, ...]:
    """What the SVG of a scene gave up, a line each."""
    return _written(scene, options).notes


def pdf_notes(scene: Scene, options: Options) -> tuple[str, ...]:
    """What the PDF of a scene gave up, a line each."""
    return notes(scene, replace(options, svg_profile=PORTABLE))


def data_uri(scene: Scene, options: Options) -> str:
    """The SVG as a data URI, for `src` and `url()`; base64, which every parser takes."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg(scene, options).encode()).decode()


def pdf(scene: Scene, options: Options) -> bytes:
    """The portable SVG as PDF, by CairoSVG. Raises Sdf2vecError where cairo is not installed."""

    text = svg(scene, replace(options, svg_profile=PORTABLE))
    try:
        import cairosvg
    except OSError:  # the package is there, the system's library is not
        raise Sdf2vecError("pdf: needs cairo: apt-get install libcairo2") from None
    made = bytes(cairosvg.svg2pdf(bytestring=text.encode()))
    return CREATED.sub(lambda found: found[1] + b"0" * len(found[2]), made)  # the same scene, the same file


def _written(scene: Scene, options: Options) -> Written:
    """The finest drawing that keeps to the size limit."""
    if scene.compositing == "additive" and (options.svg_profile == PORTABLE or scene.background is None):
        found, note = _without_sums(scene, options.svg_profile)
        written = _written(found, options)
        return Written(written.document, (note, *written.notes))
    title, limit = one_line(options.title), options.svg_size_limit
    if limit is None:
        return _drawing(scene, options.svg_profile, DETAILS[0])
    size = 0
    for detail in _details(scene, options):
        written = _drawing(scene, options.svg_profile, detail)
        size = len(written.document.text(title).encode())
        if size <= limit:
            coarser = () if detail is DETAILS[0] else (_coarser(detail, limit),)
            return Written(written.document, written.notes + coarser)
    sharp = "" if _is_sharp(scene) else ", or sharp ones (--max-falloff 0)"
    raise Sdf2vecError(
        f"svg: {size:,} bytes at least, more than the limit of {limit:,}; fit fewer shapes{sharp}"
    )


def smallest(scene: Scene, options: Options) -> str:
    """The smallest drawing of a scene there is."""
    drawn = _drawing(scene, options.svg_profile, _details(scene, options)[-1])
    return drawn.document.text(one_line(options.title))


def _details(scene: Scene, options: Options) -> list[Detail]:
    """The details that a drawing may have, finest first."""
    lean = scene.compositing == "over" and (options.svg_profile != PORTABLE or _is_sharp(scene))
    return [detail for detail in DETAILS if lean or not detail.lean]


def _is_sharp(scene: Scene) -> bool:
    """Whether no layer needs anything but plain elements."""
    canvas = Canvas.of(scene)
    return not any(is_soft(layer, canvas) for layer in scene.layers)


def _coarser(detail: Detail, limit: int) -> str:
    if detail.lean:
        return f"svg: drawn in the smallest form to stay below {limit:,} bytes (coarse coordinates, colours, blurs)"
    blurs = f", blurs down to {detail.target:g} dB" if detail.target else ", blurs for all polygons"
    return f"svg: drawn coarser to stay below {limit:,} bytes (edges to {detail.levels:g} levels{blurs})"


@lru_cache(maxsize=16)
def _drawing(scene: Scene, profile: str, detail: Detail) -> Written:
    additive = scene.compositing == "additive"
    grain = detail.lean
    canvas = Canvas.whole(scene, grain.units) if grain else Canvas.of(scene, detail.coarser)
    document = Document(canvas, detail.named)
    if scene.background is not None:
        document.body.append(tag("rect", width="100%", height="100%", fill=color_text(scene.background)))
    planned = plan(scene, document.canvas, detail, profile != PORTABLE)
    if not additive:
        off = {index: blurred.difference for index, blurred in planned.blurred.items()}
        cut = [i for i, layer in enumerate(scene.layers) if i in off or is_banded(layer, canvas)]
        scene = compensated(scene, off, cut, *((grain.colors, grain.opacities) if grain else ()))
    painter = Painter(document, detail, planned)
    if additive:
        found = _add_terms(scene, document, painter)
    else:
        found = ()
        drawn = (painter.draw(Part(layer, index)) for index, layer in enumerate(scene.layers))
        elements = [element for element in drawn if element]
        document.body += [tag("g", "\n".join(elements), **GROUP)] if grain and elements else elements
    return Written(document, found)


def _without_sums(scene: Scene, profile: str) -> tuple[Scene, str]:
    """An additive scene fitted again under `over`, and what a user should know about that."""
    from ...fit.conversion import over_of

    found, decibels = over_of(scene)
    why = "without blend modes" if profile == PORTABLE else "on a transparent ground"
    near = f" ({decibels:.1f} dB from its render)" if scene.layers else ""
    return found, f"svg: nothing can be added up {why}: fitted again under over{near}"


def _add_terms(scene: Scene, document: Document, painter: Painter) -> tuple[str, ...]:
    """Adds all terms of a signed sum to the drawing; returns a note if some of it had to be cut off."""
    ordered, lost = terms(scene) if scene.layers else ([], 0.0)

    def draw(term: Term) -> str:
        drawn = painter.draw(Part(term.layer, term.layer_index))
        return tag("g", _ground(term, document.canvas), drawn, style=DIFFERENCE) if drawn else ""

    inversion = tag("rect", width="100%", height="100%", fill="#fff", style=DIFFERENCE)
    document.body += [element for element in alternating(ordered, draw, inversion) if element]
    if lost < 1e-3:
        return ()
    decibels = -20.0 * math.log10(lost)
    return (f"svg: sums leave the range of colours on the way and are cut off: {decibels:.0f} dB at most",)


def _ground(term: Term, canvas: Canvas) -> str:
    """Black below a term, which changes nothing; without it a translucent edge would not be subtracted in full."""
    box = extent(term.layer).grown(2.0 / canvas.unit)
    (left, top), (right, bottom) = np.clip(
        canvas.places([box[:2], box[2:]]), (0.0, 0.0), (canvas.width, canvas.height)
    ).tolist()
    place = {"x": canvas.number(left), "y": canvas.number(top)}
    return tag("rect", **place, width=canvas.number(right - left), height=canvas.number(bottom - top))
