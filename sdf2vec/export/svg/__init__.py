"""SVG that looks like the render wherever it is opened; see docs/svg.md."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from dataclasses import replace
from urllib.parse import quote

from ...deferred import deferred
from ...errors import Sdf2vecError
from ...files import one_line
from ...scene import Scene
from ..exported import MARK, Exported
from ..options import Accepts, Options
from .layers import drawing
from .plan import DETAILS, Detail, Planner
from .writer import MARGINS, Style, written

PORTABLE, INKSCAPE = "portable", "inkscape"
IN_QUOTES = "!$'()*+,;=:@/?"  # what a URI takes as it is, but for "&", which HTML does not
ACCEPTED = ("over",)
CREATED = re.compile(rb"(/CreationDate \(D:)([^)]*)")
PRODUCER = re.compile(rb"(?<=/Producer \()(cairo [\d.]+) \(https?://cairographics\.org\)(?=\))")

svg2pdf: Callable[..., bytes] = deferred("cairosvg", "svg2pdf")


def accepts(options: Options) -> Accepts:
    """An SVG can lay things on each other; light on light it can't add up without leaving the range of colours."""
    return Accepts(ACCEPTED)


def svg(scene: Scene, options: Options) -> Exported:
    """The scene as SVG text in pixels of the fitted picture: the finest drawing that keeps to the size limit.

    Raises Sdf2vecError for a limit that can't be met, and for a scene that is not accepted.
    """
    return _exported(scene, options, options.svg_profile)


def _exported(scene: Scene, options: Options, profile: str) -> Exported:
    limit = options.svg_size_limit
    planner = _planner(scene, profile)
    if limit is None:
        return Exported(_text(planner, DETAILS[0], options))
    size = 0
    for detail in planner.details:
        text = _text(planner, detail, options)
        size = len(text.encode())
        if size <= limit:
            return Exported(text, notes=() if detail is DETAILS[0] else (_coarser(detail, limit),))
    sharp = ", or sharp ones (--max-falloff 0)" if any(planner.soft) else ""
    raise Sdf2vecError(
        f"svg: {size:,} bytes at least, more than the limit of {limit:,}; fit fewer shapes{sharp}"
    )


def smallest(scene: Scene, options: Options) -> str:
    """The smallest drawing of a scene there is."""
    planner = _planner(scene, options.svg_profile)
    return _text(planner, planner.details[-1], options)


def data_uri(scene: Scene, options: Options) -> Exported:
    """The SVG as a data URI, for `src="…"` and `url("…")`: URL-encoded, or in base64 where that is smaller."""
    made = svg(scene, options)
    encoded = "data:image/svg+xml;base64," + base64.b64encode(made.raw).decode()
    return replace(made, data=min(f"data:image/svg+xml,{_quoted(str(made.data))}", encoded, key=len))


def _quoted(text: str) -> str:
    """An SVG text as part of a URI, in as few characters as stand between double quotes."""
    text = text.strip().replace(">\n<", "><").replace("'", "&#39;").replace('"', "'")
    return quote(text, safe=IN_QUOTES)


def pdf(scene: Scene, options: Options) -> Exported:
    """The portable SVG as PDF, by CairoSVG. Raises Sdf2vecError where cairo is not installed."""
    made = _exported(scene, options, PORTABLE)
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
    grain = detail.grain
    style = Style(detail.named, grain is not None, grain.margins if grain else MARGINS)
    drawn = drawing(planner.scene, planner.plan(detail), detail)
    return written(drawn, one_line(options.title), style, one_line(options.alt) if options.alt else "")


def _coarser(detail: Detail, limit: int) -> str:
    if detail.grain:
        return f"svg: drawn in the smallest form to stay below {limit:,} bytes (coarse coordinates, colours, blurs)"
    blurs = f", blurs down to {detail.target:g} dB" if detail.target else ", blurs for all polygons"
    return f"svg: drawn coarser to stay below {limit:,} bytes (edges to {detail.levels:g} levels{blurs})"
