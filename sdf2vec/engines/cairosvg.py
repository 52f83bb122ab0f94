"""SVG drawn by CairoSVG, which ignores filters and blend modes: a judge of the portable profile only."""

from functools import cache

from sdf2vec.engines.engine import (
    SVG_NAMESPACE,
    EngineError,
    Picture,
    pixels_of,
    reason_missing,
    require_present,
    with_viewport,
)


@cache
def missing() -> str | None:
    """None if CairoSVG works here, else one line on what is missing and how to get it."""
    return reason_missing(_draw_nothing, "CairoSVG needs cairo: apt-get install libcairo2")


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: CairoSVG is missing, the size is out of range or the SVG is refused.
    """
    sized = with_viewport(svg, width, height)
    require_present(missing())
    import cairosvg

    try:
        png = cairosvg.svg2png(bytestring=sized.encode())
    except Exception as error:  # CairoSVG has no error of its own
        raise EngineError(f"CairoSVG refuses the SVG: {error}") from None
    return pixels_of(png)


def _draw_nothing() -> None:
    import cairosvg

    cairosvg.svg2png(bytestring=f'<svg xmlns="{SVG_NAMESPACE}" width="1" height="1"/>'.encode())
