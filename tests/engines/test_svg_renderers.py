"""Everything that draws SVG: alpha, sizes, blurs, refusals."""

import numpy as np
import pytest

from sdf2vec.engines import ENGINES, EngineError

SVG_HALF_RED = """<svg xmlns="http://www.w3.org/2000/svg" width="8" height="4" viewBox="0 0 8 4">
<rect width="4" height="4" fill="#f00" fill-opacity="0.5"/></svg>"""


@pytest.fixture
def svg_engine(request, require_engine):
    require_engine(request.param)
    return ENGINES[request.param]


SVG_ENGINES = ["resvg", "librsvg", "inkscape", "cairosvg", "chromium", "firefox"]


@pytest.mark.parametrize("svg_engine", SVG_ENGINES, indirect=True)
class TestSvg:
    def test_straight_alpha(self, svg_engine):
        pixels = svg_engine.render(SVG_HALF_RED, 8, 4)
        expected = np.zeros((4, 8, 4), np.float32)
        expected[:, :4] = (1, 0, 0, 128 / 255)
        assert pixels.dtype == np.float32
        np.testing.assert_allclose(pixels, expected, atol=1.001 / 128)  # some keep 8 premultiplied bits

    @pytest.mark.parametrize("svg", [SVG_HALF_RED, SVG_HALF_RED.replace(' viewBox="0 0 8 4"', "")])
    def test_scales_to_the_size_asked_for(self, svg_engine, svg):
        pixels = svg_engine.render(svg, 24, 12)
        assert pixels.shape == (12, 24, 4)
        assert (pixels[:, :12, 3] > 0.49).all()
        assert not pixels[:, 12:].any()

    def test_other_proportions_are_centred(self, svg_engine):
        pixels = svg_engine.render(SVG_HALF_RED, 8, 8)
        assert pixels.shape == (8, 8, 4)
        assert not pixels[[0, 1, 6, 7]].any()
        assert pixels[2:6, :4, 0].all()

    def test_a_large_and_a_small_canvas(self, svg_engine):
        assert svg_engine.render(SVG_HALF_RED, 1, 1).shape == (1, 1, 4)
        large = svg_engine.render(SVG_HALF_RED, 1500, 900)
        assert large.shape == (900, 1500, 4)
        assert (large[80:-80, :740, 0] == 1).all()

    @pytest.mark.parametrize("svg", ["", "<svg", "<p/>"])
    def test_refused_svg(self, svg_engine, svg):
        with pytest.raises(EngineError) as caught:
            svg_engine.render(svg, 4, 4)
        assert "\n" not in str(caught.value)


BLURRED = """<svg xmlns="http://www.w3.org/2000/svg" width="32" height="32" viewBox="0 0 32 32">
<filter id="b"><feGaussianBlur stdDeviation="3"/></filter>
<rect width="16" height="32" fill="#fff" filter="url(#b)"/></svg>"""


@pytest.mark.parametrize("name", SVG_ENGINES)
def test_which_engines_see_a_blur(require_engine, name):
    """CairoSVG draws the sharp shape and says nothing: it can't judge what has filters."""
    require_engine(name)
    pixels = ENGINES[name].render(BLURRED, 32, 32)
    plain = ENGINES[name].render(BLURRED.replace(' filter="url(#b)"', ""), 32, 32)
    assert (np.abs(pixels - plain).max() > 0.4) == (name != "cairosvg")
