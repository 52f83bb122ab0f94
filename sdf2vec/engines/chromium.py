"""Pages and SVG drawn by Chromium, headless, through Playwright; the browser is the system's own.

One browser is started per process and lives until the process ends, or until it no longer draws. Pages are given their
files from memory; nothing is served on a port and nothing else can be reached.
"""

import atexit
import mimetypes
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

from playwright.sync_api import BrowserContext, Page, Playwright, Route, TimeoutError, sync_playwright

from sdf2vec.engines.engine import EngineError, Picture, pixels_of, require_drawable, with_viewport

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ORIGIN = "http://localhost/"  # a secure context, which WebGPU wants; requests never leave the process
SECONDS = 60.0
TIMES = 2  # that something is drawn: a browser may stop drawing, another seldom does so, too
POLL = 20.0  # milliseconds between two looks at a page

ARGUMENTS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--force-device-scale-factor=1",
    "--force-color-profile=srgb",
    "--hide-scrollbars",
    # WebGL2 and WebGPU in software, by SwiftShader
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--disable-gpu-vsync",
    "--disable-frame-rate-limit",  # without a display there may be one frame a second
    "--disable-gpu-rasterization",  # drawings are rasterized on the CPU, the same everywhere
)

IMAGE_PAGE = (
    "<!DOCTYPE html><style>*{margin:0}img{display:block;width:100vw;height:100vh}</style>"
    '<img id="picture" src="picture.svg" alt="">'
)


@cache
def probe() -> BrowserContext:
    """The browser. Raises where it does not start."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise EngineError("Chromium is not installed")
    profile = tempfile.mkdtemp(prefix="sdf2vec-chromium-")
    atexit.register(shutil.rmtree, profile, ignore_errors=True)
    options: dict[str, Any] = {"executable_path": program, "headless": True, "args": list(ARGUMENTS)}
    browser = _playwright().chromium.launch_persistent_context(profile, device_scale_factor=1, **options)
    atexit.register(browser.close)
    return browser


@cache
def _playwright() -> Playwright:
    playwright = sync_playwright().start()
    atexit.register(playwright.stop)
    return playwright


def renew() -> None:
    """Ends the browser, if there is one: the next page gets a new one."""
    if probe.cache_info().currsize:
        probe().close()
        probe.cache_clear()


def render(svg: str, width: int, height: int) -> Picture:
    """Draws an SVG, as an `<img>` in a page, into a viewport of `width` × `height` pixels.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight (not premultiplied) alpha, row 0 at the top.

    Raises:
        EngineError: the SVG is refused.
    """
    sized = with_viewport(svg, width, height)
    return drawn({"index.html": IMAGE_PAGE, "picture.svg": sized}, width, height, _decoded)


def _decoded(page: Page) -> Picture:
    try:
        page.evaluate("document.getElementById('picture').decode()")
    except Exception as error:  # Playwright's own error; its first line is the page's exception
        raise EngineError(f"Chromium refuses the SVG: {_first_line(error)}", log=str(error)) from None
    return screenshot(page)


def drawn(
    files: Mapping[str, str | bytes], width: int, height: int, draw: Callable[[Page], Picture]
) -> Picture:
    """What `draw` makes of a page as `opened` shows it; where that stands still, of one in a new browser.

    Raises:
        EngineError: Chromium is missing, the size is out of range or that page stands still, too.
    """
    for _ in range(TIMES):
        with suppress(TimeoutError), opened(files, width, height) as page:
            return draw(page)
    raise EngineError(f"Chromium has drawn nothing in {SECONDS:g} seconds")


@contextmanager
def opened(files: Mapping[str, str | bytes], width: int, height: int) -> Iterator[Page]:
    """A page that shows `files["index.html"]` in a viewport of `width` × `height` pixels, one device pixel each.

    Other files are found by their names relative to it; every other address fails. The page is Playwright's
    (`evaluate`, `on("console", …)`), and is closed at the end. `evaluate` gives Playwright's own errors. Its
    `wait_for_function` needs `eval` and so fails under a Content-Security-Policy: `wait_until` does not.

    Raises:
        EngineError: Chromium is missing or the size is out of range.
    """
    require_drawable(width, height)
    page = probe().new_page()
    try:
        page.set_default_timeout(1000 * SECONDS)
        page.set_viewport_size({"width": width, "height": height})
        page.route("**/*", lambda route: _answer(route, files))
        page.goto(ORIGIN, wait_until="load")
        yield page
    except TimeoutError:  # of Playwright: a browser that has stopped drawing keeps to that
        renew()
        raise
    finally:
        page.close()


def wait_until(page: Page, condition: str, arg: Any = None, seconds: float = SECONDS) -> None:
    """Until a JavaScript expression, or a function of `arg`, is true on a page.

    Raises:
        EngineError: it is not in so many seconds.
    """
    end = time.monotonic() + seconds
    while not page.evaluate(condition, arg):
        if time.monotonic() > end:
            raise EngineError(f"in {seconds:g} seconds not true on the page: {condition}")
        page.wait_for_timeout(POLL)


def screenshot(page: Page, selector: str | None = None) -> Picture:
    """What a page, or the first element that a CSS selector finds in it, shows now.

    Returns:
        float32 `[height, width, 4]` in 0..1 with straight alpha: a page without a background is transparent.
    """
    place = page.locator(selector).first if selector else page
    png = place.screenshot(type="png", omit_background=True, animations="disabled")
    return pixels_of(png)


def _answer(route: Route, files: Mapping[str, str | bytes]) -> None:
    name = route.request.url.partition("?")[0].removeprefix(ORIGIN) or "index.html"
    if name in files:
        kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
        route.fulfill(body=files[name], content_type=f"{kind}; charset=utf-8")
    else:
        route.abort()


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
