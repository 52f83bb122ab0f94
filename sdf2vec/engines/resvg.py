"""SVG drawn by resvg."""

import resvg_py

from sdf2vec.engines.engine import SVG_NAMESPACE, EngineError, Picture, pixels_of, with_viewport


def probe() -> None:
    """Raises where resvg does not work."""
    resvg_py.svg_to_bytes(
        svg_string=f'<svg xmlns="{SVG_NAMESPACE}" width="1" height="1"/>', skip_system_fonts=True
    )


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    An SVG of other proportions is fitted into the viewport and centred, unless its own
    `preserveAspectRatio` says otherwise: just what a browser does.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    sized = with_viewport(svg, width, height)
    try:
        png = resvg_py.svg_to_bytes(svg_string=sized, skip_system_fonts=True)
    except ValueError as error:
        raise EngineError(f"resvg refuses the SVG: {error}", log=str(error)) from None
    return pixels_of(png)
