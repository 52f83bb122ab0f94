"""SVG drawn by Inkscape's command."""

from sdf2vec.engines.engine import Picture, answer_of, pixels_of, require_program, with_viewport

PROGRAM = "inkscape"


def probe() -> None:
    """Raises where Inkscape's command is not here."""
    require_program(PROGRAM)


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    sized = with_viewport(svg, width, height).encode()
    area = ["--export-area-page", f"--export-width={width}", f"--export-height={height}"]
    command = [PROGRAM, "--pipe", *area, "--export-type=png", "--export-filename=-"]
    pixels = pixels_of(answer_of(command, sized, "Inkscape refuses the SVG"))
    pixels[pixels[..., 3] == 0.0] = 0.0  # where nothing is drawn it says white
    return pixels
