"""SVG drawn by CairoSVG, which ignores filters and blend modes: a judge of the portable profile only."""

import cairosvg

from sdf2vec.engines.engine import SVG_NAMESPACE, EngineError, Picture, pixels_of, with_viewport


def probe() -> None:
    """Raises where CairoSVG does not work."""
    cairosvg.svg2png(bytestring=f'<svg xmlns="{SVG_NAMESPACE}" width="1" height="1"/>'.encode())


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    try:
        png = cairosvg.svg2png(bytestring=with_viewport(svg, width, height).encode())
    except Exception as error:  # CairoSVG has no error of its own
        raise EngineError(f"CairoSVG refuses the SVG: {error}") from None
    return pixels_of(png)
