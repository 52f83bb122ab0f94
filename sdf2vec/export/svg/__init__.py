"""SVG that looks like the render wherever it is opened; see docs/svg.md."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from urllib.parse import quote

from msgspec import structs

from ...deferred import deferred
from ...errors import Sdf2vecError
from ...files import one_line
from ...grain import Drawable, Grain, is_drawable
from ...scene import Scene
from ..exported import MARK, Exported
from ..options import EXACT, FIXED, Accepts, Options
from .compact import drawn, sketched
from .display import Drawing
from .layers import drawing
from .plan import DETAILS, DETAILS_EXACT, Detail, Planner
from .writer import Style, written

PORTABLE, INKSCAPE = "portable", "inkscape"
IN_QUOTES = "!$'()*+,;=:@/?"  # what a URI takes as it is, but for "&", which HTML does not
ACCEPTED = ("over",)
NEARER = 2  # of the details, which are nearer to the render than small drawings
CREATED = re.compile(rb"(/CreationDate \(D:)([^)]*)")
PRODUCER = re.compile(rb"(?<=/Producer \()(cairo [\d.]+) \(https?://cairographics\.org\)(?=\))")

svg2pdf: Callable[..., bytes] = deferred("cairosvg", "svg2pdf")


def accepts(options: Options) -> Accepts:
    """An SVG can lay things on each other; light on light it can't add up without leaving the range of colours."""
    return Accepts(ACCEPTED)


def svg(scene: Scene, options: Options) -> Exported:
    """The scene as SVG text in pixels of the fitted picture. Raises Sdf2vecError for a scene that is not accepted."""
    return svg_forms(scene, options)[0]()


def svg_forms(scene: Scene, options: Options) -> list[Callable[[], Exported]]:
    """The same, and ever coarser drawings; none that are worth less than small ones."""
    return _forms(scene, options, options.svg_profile, NEARER if draws(scene, options) else len(DETAILS))


def _forms(
    scene: Scene, options: Options, profile: str, count: int = len(DETAILS)
) -> list[Callable[[], Exported]]:
    planner = _planner(scene, profile)
    finest = [DETAILS_EXACT] if options.svg_fidelity == EXACT else []
    return [partial(_made, planner, detail, options) for detail in (*finest, *DETAILS[:count])]


def _made(planner: Planner, detail: Detail, options: Options) -> Exported:
    return Exported(
        _text(planner, detail, options),
        notes=() if detail in (DETAILS[0], DETAILS_EXACT) else (_coarser(detail),),
    )


def draws(scene: Scene, options: Options) -> bool:
    """Whether there is a small drawing of a scene."""
    return is_drawable(scene) and _planner(scene, options.svg_profile).can_be_small


def small_svg(drawable: Drawable, options: Options, grain: Grain) -> Exported:
    """What a drawing of this grain can say, in the smallest text."""
    drawing, error = drawn(drawable, grain)
    return Exported(_written(drawing, options, _small(drawable.scene, grain)), error=error)


def sketch_svg(drawable: Drawable, options: Options, grain: Grain) -> Exported:
    """The same, quickly: its size tells that of the drawing."""
    return Exported(_written(sketched(drawable, grain), options, _small(drawable.scene, grain)))


def data_uri(scene: Scene, options: Options) -> Exported:
    """The SVG as a data URI, for `src="…"` and `url("…")`: URL-encoded, or in base64 where that is smaller."""
    return data_uri_forms(scene, options)[0]()


def data_uri_forms(scene: Scene, options: Options) -> list[Callable[[], Exported]]:
    """The same, and ever coarser drawings."""
    return [partial(_as_uri, make) for make in svg_forms(scene, options)]


def small_data_uri(drawable: Drawable, options: Options, grain: Grain) -> Exported:
    """The small drawing as a data URI."""
    return _as_uri(partial(small_svg, drawable, options, grain))


def sketch_data_uri(drawable: Drawable, options: Options, grain: Grain) -> Exported:
    """The same, quickly."""
    return _as_uri(partial(sketch_svg, drawable, options, grain))


def _as_uri(make: Callable[[], Exported]) -> Exported:
    made = make()
    encoded = "data:image/svg+xml;base64," + base64.b64encode(made.raw).decode()
    return replace(made, data=min(f"data:image/svg+xml,{_quoted(str(made.data))}", encoded, key=len))


def _quoted(text: str) -> str:
    """An SVG text as part of a URI, in as few characters as stand between double quotes."""
    text = text.strip().replace(">\n<", "><").replace("'", "&#39;").replace('"', "'")
    return quote(text, safe=IN_QUOTES)


def pdf(scene: Scene, options: Options) -> Exported:
    """The portable SVG as PDF, by CairoSVG. Raises Sdf2vecError where cairo is not installed."""
    return pdf_forms(scene, options)[0]()


def pdf_forms(scene: Scene, options: Options) -> list[Callable[[], Exported]]:
    """The same, and ever coarser drawings."""
    sized = structs.replace(options, svg_size=FIXED)  # a page has a size
    return [partial(_as_pdf, make) for make in _forms(scene, sized, PORTABLE)]


def _as_pdf(make: Callable[[], Exported]) -> Exported:
    made = make()
    try:
        found = svg2pdf(bytestring=made.raw)
    except OSError:  # the package is there, the system's library is not
        raise Sdf2vecError("pdf: needs cairo: apt-get install libcairo2") from None
    # The same scene, the same file; and who made it. Places in the file stay where they are.
    undated = CREATED.sub(lambda match: match[1] + b"0" * len(match[2]), found)
    said = f"{MARK}, ".encode()
    return replace(made, data=PRODUCER.sub(lambda match: (said + match[1]).ljust(len(match[0])), undated))


def _planner(scene: Scene, profile: str) -> Planner:
    if scene.compositing not in ACCEPTED:
        raise Sdf2vecError(f"svg: takes scenes under {' or '.join(ACCEPTED)}, not {scene.compositing}")
    return Planner(scene, profile != PORTABLE, profile != INKSCAPE)


def _text(planner: Planner, detail: Detail, options: Options) -> str:
    return _written(drawing(planner.scene, planner.plan(detail), detail), options, Style(detail.named))


def _small(scene: Scene, grain: Grain) -> Style:
    return Style(named=False, compact=True, filter=grain.for_scene(scene).filter)


def _written(drawing: Drawing, options: Options, style: Style) -> str:
    style = replace(style, sized=options.svg_size == FIXED)
    return written(drawing, one_line(options.title), style, one_line(options.alt) if options.alt else "")


def _coarser(detail: Detail) -> str:
    blurs = f", blurs down to {detail.target:g} dB" if detail.target else ", blurs for all polygons"
    return f"svg: drawn coarser (edges to {detail.levels:g} levels{blurs})"
