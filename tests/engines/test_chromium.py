"""Pages in Chromium."""

import numpy as np
import pytest
from playwright.sync_api import TimeoutError

from sdf2vec.engines import EngineError, chromium


class TestChromiumPages:
    def test_files_are_found_and_nothing_else(self, require_engine):
        require_engine("chromium")
        files = {"index.html": "<!DOCTYPE html><p id=a>hello", "data/numbers.json": "[1, 2, 3]"}
        with chromium.opened(files, 40, 30) as page:
            assert page.evaluate("document.getElementById('a').textContent") == "hello"
            assert page.evaluate("fetch('data/numbers.json').then(r => r.json())") == [1, 2, 3]
            assert page.evaluate("fetch('other.json').then(() => true, () => false)") is False
            assert page.evaluate("fetch('http://192.0.2.1/').then(() => true, () => false)") is False
            assert page.evaluate("[innerWidth, innerHeight, devicePixelRatio]") == [40, 30, 1]

    def test_screenshots_of_a_page_and_of_an_element(self, require_engine):
        require_engine("chromium")
        page_text = (
            "<!DOCTYPE html><style>*{margin:0}</style><div id=d style='width:5px;height:3px;background:#f80'>"
        )
        with chromium.opened({"index.html": page_text}, 40, 30) as page:
            whole, element = chromium.screenshot(page), chromium.screenshot(page, "#d")
        assert (whole.shape, element.shape) == ((30, 40, 4), (3, 5, 4))
        np.testing.assert_allclose(element, np.broadcast_to((1, 136 / 255, 0, 1), (3, 5, 4)), atol=1e-6)
        assert not whole[3:].any()

    def test_webgl2_and_webgpu_are_there(self, require_engine):
        require_engine("chromium")
        with chromium.opened({"index.html": "<!DOCTYPE html><canvas>"}, 40, 30) as page:
            assert page.evaluate("!!document.querySelector('canvas').getContext('webgl2')")
            assert page.evaluate("navigator.gpu.requestAdapter().then(a => a !== null)")

    def test_pages_do_not_need_each_other(self, require_engine):
        require_engine("chromium")
        with (
            chromium.opened({"index.html": "a"}, 4, 3) as first,
            chromium.opened({"index.html": "b"}, 5, 6) as b,
        ):
            assert first.evaluate("document.body.textContent") == "a"
            assert b.evaluate("document.body.textContent") == "b"


class TestAPageThatStandsStill:
    @staticmethod
    def drawn(times):
        """A page of which so many times, first, something is waited for that is not there."""
        seen = []

        def draw(page):
            seen.append(page)
            if len(seen) <= times:
                page.locator("#nothing").wait_for(timeout=200)
            return chromium.screenshot(page)

        return chromium.drawn({"index.html": "<p>one"}, 50, 40, draw)

    def test_is_drawn_again(self, require_engine):
        require_engine("chromium")
        assert self.drawn(1).shape == (40, 50, 4)

    def test_a_second_time_is_said_in_one_line(self, require_engine):
        require_engine("chromium")
        with pytest.raises(EngineError, match=r"^Chromium has drawn nothing in 60 seconds$"):
            self.drawn(2)


def test_after_a_page_that_stands_still_there_is_a_new_browser(require_engine):
    require_engine("chromium")
    first = chromium.probe()
    with (
        pytest.raises(TimeoutError),
        chromium.opened({"index.html": "<p>"}, 50, 50) as page,
    ):
        page.locator("#nothing").screenshot(timeout=200)
    with chromium.opened({"index.html": "<p>"}, 50, 50) as page:
        assert chromium.screenshot(page).shape == (50, 50, 4)
    assert chromium.probe() is not first
