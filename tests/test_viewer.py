"""The viewer, driven as a person drives it: in headless Chromium, on real physics."""

import io
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs the extra `viewer`")
pytest.importorskip("playwright", reason="needs playwright to drive a browser")

from playwright.sync_api import Browser, Locator, Page, sync_playwright

from robosandbox.tasks.session import Session, open_session
from robosandbox.viewer.app import Viewer
from robosandbox.viewer.embedded import EmbeddedCell

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (apt-get install chromium)")
# WebGL on a CPU; the sandbox needs a user other than root.
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox"]
PATIENCE = 30.0


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


def open_cell(task: str | None, robot: str | None = None) -> Session:
    return open_session(task, robot=robot, render_size=(120, 160))


@contextmanager
def serving(task: str, robot: str | None = None) -> Iterator[Viewer]:
    viewer = Viewer(EmbeddedCell(open_cell(task, robot), open_cell), 0)
    viewer.start()
    try:
        yield viewer
    finally:
        viewer.stop()


@contextmanager
def page_of(browser: Browser, viewer: Viewer) -> Iterator[Page]:
    page = browser.new_page(viewport={"width": 800, "height": 480})
    # Half the pixels: they are drawn on a CPU here.
    page.goto(f"{viewer.url}/?fixedDpr=0.5")
    field(page, "Prompt").wait_for(timeout=1000 * PATIENCE)
    page.add_style_tag(content=".mantine-Notifications-root { display: none }")
    try:
        yield page
    finally:
        page.close()


def field(page: Page, label: str) -> Locator:
    return page.locator(f"xpath=//label[normalize-space()='{label}']/following::input[1]")


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def wait_until(condition: Callable[[], bool], what: str, seconds: float = PATIENCE) -> None:
    give_up = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < give_up, f"not within {seconds:g} s: {what}"
        time.sleep(0.05)


def say(page: Page, prompt: str) -> None:
    field(page, "Prompt").fill(prompt)
    button(page, "Run").click()


def red_height(page: Page) -> float | None:
    """Return how far from the picture's top the middle of what is red lies, pixels; None if nothing is."""
    from PIL import Image

    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)[:, :390]
    r, g, b = picture[..., 0], picture[..., 1], picture[..., 2]
    rows = np.nonzero((r > 110) & (r > 1.7 * g) & (r > 1.7 * b))[0]
    return float(rows.mean()) if len(rows) > 20 else None


@needs_chromium
def test_a_typed_prompt_is_carried_out_and_the_cube_rises_in_the_picture(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer, page_of(browser, viewer) as page:
        wait_until(lambda: red_height(page) is not None, "the cube is seen")
        before = red_height(page)
        say(page, "pick up the red cube")
        page.get_by_text("judged on the simulated state: success").wait_for(timeout=1000 * PATIENCE)
        wait_until(lambda: (red_height(page) or 1e9) < (before or 0.0) - 15.0, "the cube is higher in the picture")
        session = viewer.cell.workcell
        assert isinstance(session, Session) and session.sim.held() == "red_cube"
        seconds = session.sim.time
        assert viewer.feed.drawn / seconds >= 20.0


@needs_chromium
def test_stop_halts_the_arm_and_step_back_undoes_it(browser: Browser) -> None:
    with serving("stack_two") as viewer, page_of(browser, viewer) as page:
        session = viewer.cell.workcell
        assert isinstance(session, Session)
        home = session.sim.observe().q
        button(page, "Run").click()
        wait_until(lambda: session.sim.time > 0.4, "the arm is on its way")
        button(page, "Stop").click()
        page.get_by_text("cancelled:").wait_for(timeout=1000 * PATIENCE)
        stopped = session.sim.observe()
        assert np.abs(stopped.qd).max() < 0.02
        assert np.abs(stopped.q - home).max() > 0.01
        steps = session.sim.physics_steps
        time.sleep(0.3)
        assert session.sim.physics_steps == steps, "physics runs while nothing is done"
        button(page, "Step back").click()
        page.get_by_text(f"back to before: {session.task.prompt}").wait_for(timeout=1000 * PATIENCE)
        assert np.allclose(session.sim.observe().q, home)


@needs_chromium
def test_a_page_of_another_site_is_not_let_in(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer:
        page = browser.new_page()
        page.goto("data:text/html,<p>elsewhere</p>")
        address = viewer.url.replace("http", "ws")
        opened = page.evaluate(
            "address => new Promise(done => { const s = new WebSocket(address, 'viser-v1.1.1');"
            "s.onopen = () => done(true); s.onerror = () => done(false); })",
            address,
        )
        page.close()
        assert opened is False


def test_the_viewer_can_be_reached_from_this_machine_alone() -> None:
    with serving("pick_cube_franka") as viewer:
        assert viewer.server.get_host() == "127.0.0.1"
        assert viewer.server.request_share_url() is None
