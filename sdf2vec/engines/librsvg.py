"""SVG drawn by librsvg's command."""

from sdf2vec.engines.engine import Picture, answer_of, pixels_of, require_program, with_viewport

PROGRAM = "rsvg-convert"


def probe() -> None:
    """Raises where librsvg's command is not here."""
    require_program(PROGRAM)


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    sized = with_viewport(svg, width, height).encode()
    return pixels_of(answer_of([PROGRAM, "--unlimited"], sized, "librsvg refuses the SVG"))
