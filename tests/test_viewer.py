"""The viewer, driven as a person drives it: in headless Chromium, on real physics."""

import dataclasses
import http.client
import io
import itertools
import json
import re
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs the extra `viewer`")
pytest.importorskip("playwright", reason="needs playwright to drive a browser")

import websockets.sync.client
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, sync_playwright
from support.processes import SimProcess

from robosandbox.agent.episode import Intended, PhaseEntered, SkillStarted
from robosandbox.apps.cli import app
from robosandbox.apps.commands import viewer as viewer_command
from robosandbox.apps.commands.console import EXIT_USAGE, run_app
from robosandbox.apps.commands.world import Connection
from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.app import Viewer
from robosandbox.apps.viewer.connected import ConnectedSource
from robosandbox.apps.viewer.dragging import level
from robosandbox.apps.viewer.embedded import EmbeddedSource
from robosandbox.apps.viewer.framing import FOV, Viewpoint, Window, first_view
from robosandbox.apps.viewer.layers.grasps import glyph
from robosandbox.apps.viewer.news import Began, Came, Complaint, Doing, Idle, News, Presence, Went
from robosandbox.apps.viewer.panels.order_form import answer_form
from robosandbox.apps.viewer.panels.prompt import PromptPanel
from robosandbox.apps.viewer.panels.repairs import RepairsPanel
from robosandbox.apps.viewer.panels.strip import Lane, strip
from robosandbox.apps.viewer.server import open_server
from robosandbox.apps.viewer.sidecar_file import Changes, SidecarFile
from robosandbox.apps.viewer.source import Frame
from robosandbox.apps.viewer.timeline import PhaseSpan, Recording, Timeline
from robosandbox.errors import InputError
from robosandbox.robots.locate import resolve_robot
from robosandbox.types import Array, GraspSearch, Scene, Trajectory
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.options import USUAL
from robosandbox.workcell.session import open_session
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (apt-get install chromium)")
# WebGL on a CPU; the sandbox needs a user other than root.
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox"]
# For machines that have much else to do.
PATIENCE = 120.0


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


@contextmanager
def serving(task: str, robot: str | None = None, *, what_if: bool = True, max_replans: int = 3) -> Iterator[Viewer]:
    cell = open_session(task, robot=robot, render_size=(120, 160), what_if=what_if, max_replans=max_replans)
    viewer = Viewer(EmbeddedSource(WorkcellHost(cell, pace="watched")), 0)
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


@pytest.fixture(scope="module")
def open_viewer() -> Iterator[Viewer]:
    with serving("pick_cube_franka") as viewer:
        yield viewer


@pytest.fixture(scope="module")
def first_page(browser: Browser, open_viewer: Viewer) -> Iterator[Page]:
    # A page's first picture, whose shaders are compiled for a CPU, takes longer than all that a test does with it.
    with page_of(browser, open_viewer) as page:
        yield page


@pytest.fixture(scope="module")
def three() -> Iterator[Viewer]:
    with serving("pick_from_three") as viewer:
        yield viewer


@pytest.fixture(scope="module")
def first_three(browser: Browser, three: Viewer) -> Iterator[Page]:
    with page_of(browser, three) as page:
        yield page


@dataclass(frozen=True)
class Desk:
    """A viewer, its world as the task has it, and a page that other tests have used before."""

    viewer: Viewer
    session: EmbeddedWorkcell
    page: Page
    ends: list[Callable[[], None]] = dataclasses.field(default_factory=list)

    def watch(self, listener: Callable[[], None]) -> None:
        """Have a listener told of ticks for this test."""
        self.ends.append(self.session.driver.subscribe(listener))


@pytest.fixture
def desk(open_viewer: Viewer, first_page: Page) -> Iterator[Desk]:
    session = open_viewer.source.host.cell
    assert isinstance(session, EmbeddedWorkcell)
    listeners, made = list(open_viewer.control.listeners), Desk(open_viewer, session, first_page)
    yield made
    for end in made.ends:
        end()
    open_viewer.control.listeners[:] = listeners
    open_viewer.control.reset(0)
    wait_until(lambda: open_viewer.control.doing is Doing.NOTHING, "the task's first layout")


def field(page: Page, label: str) -> Locator:
    return page.locator(f"xpath=//label[normalize-space()='{label}']/following::input[1]")


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def wait_until(condition: Callable[[], bool], what: str, seconds: float = PATIENCE) -> None:
    give_up = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < give_up, f"not within {seconds:g} s: {what}"
        time.sleep(0.05)


def wait_for(event: threading.Event) -> None:
    assert event.wait(PATIENCE)


@dataclass
class Clock:
    """Whether simulated time kept up with the wall's: on a machine that has no time, rates say nothing."""

    first: tuple[float, float] | None = None
    last: tuple[float, float] = (0.0, 0.0)

    def see(self, simulated: float) -> None:
        self.last = (simulated, time.monotonic())
        self.first = self.first or self.last

    @property
    def kept_real_time(self) -> bool:
        assert self.first is not None
        simulated, wall = (b - a for a, b in zip(self.first, self.last, strict=True))
        return wall < 1.2 * simulated


def say(page: Page, prompt: str) -> None:
    field(page, "Prompt").fill(prompt)
    button(page, "Run").click()


def red_middle(page: Page) -> tuple[float, float] | None:
    """Return the middle of what is red in the scene, pixels from the left and from the top; None if nothing is."""
    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)[:, :390]
    r, g, b = picture[..., 0], picture[..., 1], picture[..., 2]
    rows, columns = np.nonzero((r > 110) & (r > 1.7 * g) & (r > 1.7 * b))
    return (float(columns.mean()), float(rows.mean())) if len(rows) > 20 else None


def red_height(page: Page) -> float | None:
    """Return how far from the picture's top the middle of what is red lies, pixels."""
    middle = red_middle(page)
    return middle[1] if middle else None


@needs_chromium
def test_a_typed_prompt_is_carried_out_and_the_cube_rises_in_the_picture(desk: Desk) -> None:
    viewer, session, page = desk.viewer, desk.session, desk.page
    wait_until(lambda: red_height(page) is not None, "the cube is seen")
    before = red_height(page)
    clock = Clock()
    desk.watch(lambda: clock.see(session.driver.time))
    drawn, began = viewer.stream.drawn, session.driver.time
    say(page, "pick up the red cube")
    page.get_by_text("judged on the simulated state: success").wait_for(timeout=1000 * PATIENCE)
    wait_until(lambda: (red_height(page) or 1e9) < (before or 0.0) - 15.0, "the cube is higher in the picture")
    assert session.mujoco.in_hands()["hand"] == "red_cube"
    assert viewer.stream.drawn - drawn > 20
    if clock.kept_real_time:
        assert (viewer.stream.drawn - drawn) / (session.driver.time - began) >= 20.0


@needs_chromium
def test_stop_halts_the_arm_and_step_back_undoes_it(desk: Desk) -> None:
    session, page = desk.session, desk.page
    home, began = session.driver.state().q, session.driver.time
    # However slowly the browser clicks: the arm waits for it on its way, and then goes on slowly until the click is heard.
    clicked = threading.Event()
    desk.watch(lambda: time.sleep(0.03) if clicked.is_set() or session.driver.time - began < 0.5 else wait_for(clicked))
    say(page, session.task.prompt)
    wait_until(lambda: session.driver.time - began > 0.4, "the arm is on its way")
    button(page, "Stop").click()
    clicked.set()
    page.get_by_text("stopped: the arm holds").wait_for(timeout=1000 * PATIENCE)
    stopped = session.driver.state()
    assert np.abs(stopped.qd).max() < 0.02
    assert np.abs(stopped.q - home).max() > 0.01
    steps = session.simulation.physics_steps
    time.sleep(0.3)
    assert session.simulation.physics_steps == steps, "physics runs while nothing is done"
    button(page, "Step back").click()
    page.get_by_text(f"back to before: {session.task.prompt}").wait_for(timeout=1000 * PATIENCE)
    assert np.allclose(session.driver.state().q, home)


# Milliseconds a key, None for pasted text, and how it is sent off: at 0 and 30 viser's own queue of 50 ms drops the last letters.
SENT_OFF = [(pause, sent) for sent in ("Enter", "Run") for pause in (0, 30, 80, None)]


@needs_chromium
@pytest.mark.parametrize(("pause", "sent"), SENT_OFF)
def test_what_runs_is_what_the_box_shows_however_fast_it_is_typed_or_pasted(
    desk: Desk, pause: int | None, sent: str
) -> None:
    # A sentence that is refused at once: what is tested is how it arrives.
    said = f"pick up teapot {SENT_OFF.index((pause, sent))}"
    viewer, page = desk.viewer, desk.page
    began: list[str] = []
    viewer.control.listeners.append(lambda news: began.append(news.what) if isinstance(news, Began) else None)
    box = field(page, "Prompt")
    box.fill("")
    if pause is None:
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        page.evaluate("text => navigator.clipboard.writeText(text)", said)
        box.press("Control+v")
    else:
        box.press_sequentially(said, delay=pause)
    if sent == "Enter":
        page.keyboard.press("Enter")
    else:
        button(page, sent).click()
    wait_until(lambda: len(began) == 1 and viewer.control.doing is Doing.NOTHING, "it was run once")
    assert began == [said] and box.input_value() == said
    page.get_by_text(f"“{said}”", exact=True).wait_for(timeout=1000 * PATIENCE)


@needs_chromium
@pytest.mark.parametrize("by", ["button", "scene"])
def test_a_question_is_answered_by_a_click(first_three: Page, three: Viewer, by: str) -> None:
    page, session = first_three, three.source.host.cell
    three.control.reset(0)
    page.get_by_text("seed 0", exact=True).wait_for(timeout=1000 * PATIENCE)
    say(page, "pick up the cube")
    page.get_by_text("Which one do you mean").wait_for(timeout=1000 * PATIENCE)
    if by == "button":
        button(page, "red_cube").click()
    else:
        wait_until(lambda: red_middle(page) is not None, "the cube is seen")
        page.mouse.click(*(red_middle(page) or (0.0, 0.0)))
    page.get_by_text("done: pick(object=red_cube)").wait_for(timeout=1000 * PATIENCE)
    assert session.observe().held == "red_cube" and button(page, "green_cube").count() == 0
    assert field(page, "Prompt").input_value() == "pick up the cube"


@needs_chromium
def test_try_and_judge_are_buttons_and_stop_is_a_word(desk: Desk) -> None:
    session, page = desk.session, desk.page
    field(page, "Prompt").fill("pick up the red cube")
    button(page, "Try").click()
    page.get_by_text("would work, in").wait_for(timeout=1000 * PATIENCE)
    assert session.mujoco.in_hands()["hand"] is None
    button(page, "Judge").click()
    page.get_by_text("judged on the simulated state: no success").wait_for(timeout=1000 * PATIENCE)
    # However slowly the browser types: the arm waits for it on its way, and then goes on slowly until the word is heard.
    typed, began = threading.Event(), session.driver.time
    desk.watch(lambda: time.sleep(0.03) if typed.is_set() or session.driver.time - began < 0.5 else wait_for(typed))
    button(page, "Run").click()
    wait_until(lambda: session.driver.time - began > 0.4, "the arm is on its way")
    field(page, "Prompt").fill("stop")
    page.keyboard.press("Enter")
    typed.set()
    page.get_by_text("stopped: the arm holds").wait_for(timeout=1000 * PATIENCE)
    assert session.mujoco.in_hands()["hand"] is None


@needs_chromium
def test_an_order_that_cannot_be_carried_out_is_answered_beside_the_box(desk: Desk) -> None:
    page = desk.page
    field(page, "Prompt").fill(" ")
    button(page, "Run").click()
    page.get_by_text("the prompt is empty").wait_for(timeout=1000 * PATIENCE)
    page.evaluate("document.querySelector('.order').setAttribute('novalidate', '')")
    field(page, "Seed").fill("-1")
    button(page, "Reset").click()
    page.get_by_text("seed: Input should be greater than or equal to 0").wait_for(timeout=1000 * PATIENCE)
    assert desk.viewer.control.doing is Doing.NOTHING


def asked(viewer: Viewer, path: str, headers: dict[str, str]) -> int:
    """Return the status of the answer to a request whose headers are given, a missing Host included."""
    connection = http.client.HTTPConnection(viewer.server.get_host(), viewer.server.get_port(), timeout=PATIENCE)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    status = connection.getresponse().status
    connection.close()
    return status


HANDSHAKE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}
STRANGERS: list[dict[str, str]] = [
    {},
    {"Host": "rebound.example:{port}"},
    {"Host": "127.0.0.1.rebound.example:{port}"},
    {"Host": "localhost@rebound.example"},
    {"Host": "0.0.0.0:{port}"},
]
OTHER_PAGES = [
    "http://elsewhere.example",
    "http://127.0.0.1:1",
    "http://localhost:{port}",
    "https://127.0.0.1:{port}",
    "null",
]


@pytest.mark.parametrize("path", ["/", "/order", "/no-such-page"])
@pytest.mark.parametrize("upgrade", [False, True], ids=["http", "websocket"])
def test_only_requests_to_a_name_of_this_machine_are_answered(open_viewer: Viewer, path: str, upgrade: bool) -> None:
    port = str(open_viewer.server.get_port())
    more = HANDSHAKE if upgrade else {}
    for stranger in STRANGERS:
        headers = {name: value.format(port=port) for name, value in stranger.items()}
        assert asked(open_viewer, path, {**headers, **more}) == 403, headers
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", "LOCALHOST", "localhost:9000"):
        answered = 101 if upgrade else 200 if path == "/" else 404
        assert asked(open_viewer, path, {"Host": host, **more}) == answered, host


@pytest.mark.parametrize("path", ["/", "/order"])
def test_only_the_viewers_own_pages_get_a_websocket(open_viewer: Viewer, path: str) -> None:
    port = str(open_viewer.server.get_port())
    own = {"Host": f"127.0.0.1:{port}", **HANDSHAKE}
    for origin in OTHER_PAGES:
        assert asked(open_viewer, path, {**own, "Origin": origin.format(port=port)}) == 403, origin
    assert asked(open_viewer, path, {**own, "Origin": f"http://127.0.0.1:{port}"}) == 101


@needs_chromium
@pytest.mark.parametrize("path", ["", "/order"])
def test_a_page_of_another_site_is_not_let_in(browser: Browser, open_viewer: Viewer, path: str) -> None:
    page = browser.new_page()
    page.goto("data:text/html,<p>elsewhere</p>")
    address = open_viewer.url.replace("http", "ws") + path
    opened = page.evaluate(
        "address => new Promise(done => { const s = new WebSocket(address, 'viser-v1.1.1');"
        "s.onopen = () => done(true); s.onerror = () => done(false); })",
        address,
    )
    page.close()
    assert opened is False


def test_the_viewer_can_be_reached_from_this_machine_alone(open_viewer: Viewer) -> None:
    assert open_viewer.server.get_host() == "127.0.0.1"
    assert open_viewer.server.request_share_url() is None


FAR = """
name: far
prompt: "pick up the red cube"
scene:
  objects:
    - {id: red_cube, kind: box, size: [0.02, 0.02, 0.02], pose: {xyz: [0.47, 0.44, 0.061]}, rgba: [0.85, 0.2, 0.2, 1.0]}
success: {kind: lifted, object: red_cube, min_mm: 50}
"""
CUBE = "    - {{id: {name}, kind: box, size: [0.02, 0.02, 0.02], pose: {{xyz: [{x}, {y}, 0.061]}}, rgba: [0.2, 0.2, 0.85, 1.0]}}\n"
SIDES = ((0.193, 0.0), (0.107, 0.0), (0.15, 0.043), (0.15, -0.043))
ENCLOSED = (
    FAR.replace("name: far", "name: enclosed")
    .replace("0.47, 0.44", "0.15, 0.0")
    .replace(
        "success:", "".join(CUBE.format(name=f"blue_{k}", x=x, y=y) for k, (x, y) in enumerate(SIDES)) + "success:"
    )
)


def task_file(folder: Path, text: str) -> str:
    path = folder / "task.yaml"
    path.write_text(text)
    return str(path)


def panda_in(folder: Path) -> Path:
    """Return a copy of the Panda in a folder, its sidecar beside it."""
    source = resolve_robot(None)
    for name in ("panda.xml", "panda.robosandbox.yaml"):
        shutil.copy(source.with_name(name), folder / name)
    return folder / "panda.xml"


def scene_names(viewer: Viewer, part: str) -> list[str]:
    """Return the names of the scene's nodes that have a part in them."""
    return [name for name in viewer.server.scene._handle_from_node_name if part in name]


@pytest.mark.slow
@needs_chromium
def test_an_unreachable_pose_is_drawn_beside_the_nearest_reachable_one(browser: Browser, tmp_path: Path) -> None:
    robot = panda_in(tmp_path)
    sidecar = robot.with_name("panda.robosandbox.yaml")
    sidecar.write_text(sidecar.read_text().replace("xyz: [-0.3, 0.0, 0.0]", "xyz: [-0.7, 0.0, 0.0]"))
    task = task_file(tmp_path, FAR)
    with serving(task, str(robot), what_if=False) as viewer, page_of(browser, viewer) as page:
        button(page, "Run").click()
        page.get_by_text("unreachable during plan").wait_for(timeout=1000 * PATIENCE)
        assert scene_names(viewer, "/target") and scene_names(viewer, "/nearest") and scene_names(viewer, "/gap")
        button(page, "Reset").click()
        page.get_by_text("seed 0", exact=True).wait_for(timeout=1000 * PATIENCE)
        assert not scene_names(viewer, "/target")


@needs_chromium
@pytest.mark.slow
def test_a_blocking_pair_is_red_and_a_repair_button_frees_the_cube(browser: Browser, tmp_path: Path) -> None:
    with serving(task_file(tmp_path, ENCLOSED), max_replans=0) as viewer, page_of(browser, viewer) as page:
        session = viewer.source.host.cell
        assert isinstance(session, EmbeddedWorkcell)
        button(page, "Run").click()
        page.get_by_text("collision during plan").wait_for(timeout=1000 * PATIENCE)
        marked = scene_names(viewer, "/mark")
        assert len(marked) == 2 and any("finger" in name for name in marked) and any("blue" in name for name in marked)
        page.locator("button", has_text="Repair 1").click()
        page.get_by_text("done: pick").wait_for(timeout=1000 * PATIENCE)
        assert session.mujoco.in_hands()["hand"] == "red_cube"
        assert not scene_names(viewer, "/mark")


@needs_chromium
@pytest.mark.slow
def test_keys_jog_the_tcp_and_the_mouse_drags_a_cube(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer, page_of(browser, viewer) as page:
        session = viewer.source.host.cell
        assert isinstance(session, EmbeddedWorkcell)
        before = session.driver.state().tcp_pose.position
        page.keyboard.press("u")
        wait_until(lambda: viewer.control.doing is Doing.NOTHING and session.driver.time > 0.0, "a jog")
        wait_until(lambda: session.driver.state().tcp_pose.xyz[2] > before[2] + 0.008, "the TCP is 10 mm higher")
        moved = session.driver.state().tcp_pose.position - before
        assert np.abs(moved - [0.0, 0.0, 0.01]).max() < 0.002

        lying = session.simulation.truth().objects["red_cube"].pose.position
        wait_until(lambda: red_middle(page) is not None, "the cube is seen")
        x, y = red_middle(page) or (0.0, 0.0)
        page.mouse.move(x, y)
        page.mouse.down()
        for step in range(1, 9):
            page.mouse.move(x + 6 * step, y + 3 * step)
            time.sleep(0.05)
        page.mouse.up()
        wait_until(
            lambda: (
                viewer.control.doing is Doing.NOTHING
                and np.abs(session.simulation.truth().objects["red_cube"].pose.position[:2] - lying[:2]).max() > 0.02
            ),
            "the cube lies elsewhere",
        )
        dropped = session.simulation.truth().objects["red_cube"].pose.position
        assert abs(dropped[2] - lying[2]) < 0.001, "it lies on the table again"


@needs_chromium
@pytest.mark.slow
def test_two_browsers_see_the_same_world_and_another_one_can_be_loaded(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer, page_of(browser, viewer) as one, page_of(browser, viewer) as two:
        one.get_by_role("tab", name="World").click()
        field(one, "Task").click()
        one.get_by_role("option", name="pick_from_three", exact=True).click()
        button(one, "Load").click()
        two.get_by_text("loaded pick_from_three").wait_for(timeout=1000 * PATIENCE)
        assert viewer.source.host.cell.task.name == "pick_from_three"
        assert scene_names(viewer, "green_cube")
        assert field(two, "Prompt").input_value() == viewer.source.host.cell.task.prompt


@needs_chromium
@pytest.mark.slow
def test_a_slider_writes_the_sidecar_back_with_its_comments(browser: Browser, tmp_path: Path) -> None:
    robot = panda_in(tmp_path)
    sidecar = robot.with_name("panda.robosandbox.yaml")
    before = sidecar.read_text()
    with serving("pick_cube_franka", robot=str(robot)) as viewer, page_of(browser, viewer) as page:
        page.get_by_role("tab", name="Sidecar").click()
        box = field(page, "base x, m").locator("xpath=following::input[1]")
        box.fill("-0.35")
        box.press("Enter")
        wait_until(lambda: bool(scene_names(viewer, "SidecarPreview/robot")), "the change is drawn")
        button(page, "Save and reload").click()
        page.get_by_text("loaded pick_cube_franka").wait_for(timeout=1000 * PATIENCE)
        assert viewer.source.blueprint.robot.base_position[0] == pytest.approx(-0.35)
    assert sidecar.read_text() == before.replace("[-0.3, 0.0, 0.0]", "[-0.35, 0.0, 0.0]")


@needs_chromium
@pytest.mark.gl
@pytest.mark.slow
def test_a_picture_with_what_perception_sees_is_rendered_only_when_asked_for(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer, page_of(browser, viewer) as page:
        source = viewer.source
        assert isinstance(source, EmbeddedSource) and source.host.studio.frames == 0
        page.get_by_role("tab", name="Camera").click()
        page.get_by_text("Live picture", exact=True).locator("xpath=following::input[1]").check()
        page.get_by_text("red box at").wait_for(timeout=1000 * PATIENCE)
        assert source.host.studio.frames == 1
        time.sleep(0.5)
        assert source.host.studio.frames == 1, "nothing moves, so nothing is drawn"


@needs_chromium
@pytest.mark.slow
def test_an_idle_viewer_with_a_browser_costs_almost_nothing_and_runs_no_physics(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer, page_of(browser, viewer):
        session = viewer.source.host.cell
        assert isinstance(session, EmbeddedWorkcell)
        wait_until(lambda: viewer.stream.drawn > 0, "the first frame")
        time.sleep(1.0)
        steps, drawn, began = session.simulation.physics_steps, viewer.stream.drawn, time.process_time()
        time.sleep(3.0)
        assert session.simulation.physics_steps == steps and viewer.stream.drawn == drawn
        assert time.process_time() - began < 0.03 * 3.0


def colour_of(page: Page, name: str) -> str:
    return str(button(page, name).evaluate("one => getComputedStyle(one).backgroundColor"))


@pytest.mark.slow
@needs_chromium
def test_stop_is_red_while_the_arm_moves_and_the_strip_draws_what_it_does(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer, page_of(browser, viewer) as page:
        session = viewer.source.host.cell
        assert isinstance(session, EmbeddedWorkcell)
        # However slowly the browser draws: half a second into the run the arm waits until the page was looked at.
        looked = threading.Event()
        page.get_by_text("What moves is drawn here").wait_for(timeout=1000 * PATIENCE)
        began = session.driver.time
        session.driver.subscribe(lambda: wait_for(looked) if session.driver.time - began > 0.5 else None)
        quiet = colour_of(page, "Stop")
        button(page, "Run").click()
        try:
            wait_until(lambda: colour_of(page, "Stop") == "rgb(198, 35, 35)", "Stop is red")
        finally:
            looked.set()
        page.get_by_text("judged on the simulated state: success").wait_for(timeout=1000 * PATIENCE)
        wait_until(lambda: colour_of(page, "Stop") == quiet, "Stop is quiet again")
        phases = page.locator(".strip .phases span")
        wait_until(lambda: {"approach", "lift"} <= set(phases.all_inner_texts()), "the phases are drawn")
        assert page.locator(".strip polyline").count() == 3
        words = page.locator(".strip").inner_text()
        assert " °/s" in words and " mm" in words and " N" in words
        gripper = session.driver.state().gripper
        assert gripper is not None
        wait_until(lambda: f"{1000 * gripper.width:.1f} mm" in page.locator(".strip").inner_text(), "the last opening")
        assert "-0.0" not in page.locator("body").inner_text()


@pytest.mark.slow
@needs_chromium
def test_a_phone_shows_the_orders_over_its_whole_width_and_the_objects_above_them(browser: Browser) -> None:
    with serving("pick_cube_franka") as viewer:
        page = browser.new_page(viewport={"width": 390, "height": 844})
        page.goto(f"{viewer.url}/?fixedDpr=0.5")
        field(page, "Prompt").wait_for(timeout=1000 * PATIENCE)
        for name in ("Run", "Plan", "Try", "Stop", "Step back", "Judge", "Reset"):
            box = button(page, name).bounding_box()
            assert (
                box is not None and box["x"] >= 0 and box["x"] + box["width"] <= 390 and box["y"] + box["height"] <= 844
            )
            assert box["height"] >= 24, "a finger hits it (WCAG 2.2, 2.5.8)"
        prompt = field(page, "Prompt").bounding_box()
        assert prompt is not None and prompt["width"] > 350
        wait_until(lambda: red_middle(page) is not None, "the cube is seen")
        assert (red_height(page) or 844.0) < 0.4 * 844
        # A slow page comes to the usual view after the one that was made for it, and so does one whose view is reset.
        (client,) = viewer.server.get_clients().values()
        fitting, usual = client.camera.position, viewer.server.initial_camera
        with client.atomic():
            client.camera.position, client.camera.look_at = usual.position, usual.look_at
        wait_until(lambda: np.allclose(client.camera.position, fitting, atol=0.01), "the view that fits")
        wait_until(lambda: (red_height(page) or 844.0) < 0.4 * 844, "the cube above the panel")
        page.close()


def test_what_a_person_stopped_is_no_failure_to_repair() -> None:
    with serving("pick_cube_franka", max_replans=0) as viewer:
        control, repairs = viewer.control, next(item for item in viewer._hearing if isinstance(item, RepairsPanel))
        control.listeners.append(lambda news: control.stop() if isinstance(news, SkillStarted) else None)
        ended: list[Came] = []
        control.listeners.append(lambda news: ended.append(news) if isinstance(news, Came) else None)
        control.run("pick up the red cube")
        wait_until(lambda: bool(ended) and control.doing is Doing.NOTHING, "the end")
        assert ended[0].result.data["reason"] == "cancelled" and not repairs._folder.visible


def test_a_complaint_does_not_stand_under_the_order_before() -> None:
    with serving("home") as viewer:
        control, prompt = viewer.control, next(item for item in viewer._hearing if isinstance(item, PromptPanel))
        control.run("asdf")
        wait_until(lambda: "asdf" in prompt._board.content and control.doing is Doing.NOTHING, "the refusal")
        prompt.hear(Complaint("the prompt is empty: say what the robot should do"))
        assert "the prompt is empty" in prompt._board.content and "asdf" not in prompt._board.content


def projected(points: Array, view: Viewpoint, window: Window) -> Array:
    """Return where points (k, 3) lie in a picture, from -1 to 1 to the right and upwards, shape (k, 2)."""
    forward = (view.look_at - view.position) / np.linalg.norm(view.look_at - view.position)
    right = np.cross(forward, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(forward, [0.0, 0.0, 1.0]))
    local = (points - view.position) @ np.stack([right, np.cross(right, forward), forward]).T
    assert (local[:, 2] > 0.0).all()
    half = np.tan(FOV / 2.0)
    return np.asarray(local[:, :2] / local[:, 2:] / [half * window.aspect, half])


@pytest.mark.parametrize("window", [Window(aspect=1.3), Window(aspect=2.2), Window(aspect=0.46, bottom=0.6)], ids=str)
@pytest.mark.parametrize("task", ["pick_cube_franka", "sort_by_colour", "put_in_drawer"])
def test_the_first_view_has_all_objects_and_the_gripper_in_the_free_part(task: str, window: Window) -> None:
    with open_session(task) as session:
        source = EmbeddedSource(WorkcellHost(session))
        view = first_view(source.blueprint, window)
        seen = session.observe()
        places = np.array([item.pose.position for item in seen.objects] + [session.driver.state().tcp_pose.position])
        half = float(np.max(session.task.scene.objects[0].size))
    pictures = projected(places, view, window)
    assert (np.abs(pictures[:, 0]) < 1.0).all()
    assert (pictures[:, 1] < 1.0).all() and (pictures[:, 1] > 2.0 * window.bottom - 1.0).all()
    if task == "pick_cube_franka" and not window.bottom:
        corners = places[0] + half * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
        assert np.ptp(projected(corners, view, window)[:, 1]) > 2.0 * 0.045, "a cube of 40 mm is 29 of 640 pixels high"


def test_the_strip_keeps_peaks_marks_what_failed_and_has_units() -> None:
    seconds = np.linspace(10.0, 20.0, 3000)
    speed = np.zeros(3000)
    speed[1234] = 42.0
    phases = (PhaseSpan("approach", 10.0), PhaseSpan("<descend>", 15.0, failed=True))
    recording = Recording(seconds=seconds, values=speed[:, None], phases=phases)
    drawn = strip(recording, (Lane("Joint speed", "°/s", "blue", 10.0),))
    points = re.search(r'points="([^"]*)"', drawn)
    assert points is not None
    heights = [float(point.split(",")[1]) for point in points.group(1).split()]
    # 42 of 50, of which the top is 96 of 100.
    assert len(heights) <= 300 and min(heights) == pytest.approx(100.0 - 96.0 * 42.0 / 50.0, abs=0.1)
    assert "&lt;descend&gt; failed" in drawn and "<descend>" not in drawn
    assert "0.0 °/s" in drawn and "50 °/s" in drawn and "left:50.00%;width:50.00%" in drawn


def test_a_step_back_begins_the_timeline_anew() -> None:
    with open_session("pick_cube_franka") as session:
        blueprint = EmbeddedSource(WorkcellHost(session)).blueprint
        timeline = Timeline()
        at = session.driver.state()
        for seconds in (1.0, 1.5, 1.5, 0.5):
            timeline.enter(f"at {seconds}")
            seen = replace(at, time=seconds, arms={"arm": replace(at.arms["arm"], qd=np.full(len(at.q), -0.5))})
            timeline.add(
                Frame(model=session.mujoco.model, seen=seen, hands={}, qpos=session.simulation.snapshot()), blueprint
            )
        assert timeline.recording().seconds.tolist() == [0.5] and timeline.recording().phases == ()
        assert timeline.recording().values[0, 0] == pytest.approx(np.degrees(0.5))
        assert (blueprint.speed_unit, blueprint.force_unit()) == ("°/s", "N")


@pytest.mark.parametrize(
    ("value", "said"), [(-0.04, "0.0"), (-0.0, "0.0"), (0.04, "0.0"), (-0.06, "-0.1"), (12.34, "12.3")]
)
def test_what_rounds_to_nothing_has_no_sign(value: float, said: str) -> None:
    assert html.number(value, 1) == said


def test_a_sidecar_that_does_not_fit_is_not_written(tmp_path: Path) -> None:
    file = SidecarFile.of(Scene(robot_urdf=panda_in(tmp_path)))
    before = file.target.read_text()
    outside = Changes(home_qpos=(9.0, *file.sidecar.arm.home_qpos[1:]), tcp_xyz=None, base_xyz=(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"panda\.robosandbox\.yaml: .*home_qpos"):
        file.write(outside, file.target)
    assert file.target.read_text() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["panda.robosandbox.yaml", "panda.xml"]


def test_a_bundled_robots_sidecar_is_not_overwritten() -> None:
    assert SidecarFile.of(Scene()).target == Path.cwd() / "panda.robosandbox.yaml"


def test_the_mouse_moves_an_object_along_the_level_at_which_it_was_grabbed() -> None:
    eye, grabbed = np.array([1.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.1])
    assert np.allclose(level(eye, np.array([0.5, 0.0, 0.55]), grabbed), [0.0, 0.0, 0.1])
    assert np.allclose(level(eye, np.array([0.0, 0.0, 2.0]), grabbed), grabbed)


def test_what_is_said_is_shown_as_text() -> None:
    assert "<script" not in html.line("<script>alert(1)</script>")
    assert "<b>" not in html.rows([("<b>", "<b>")])


def test_paths_and_grasps_are_in_the_event_stream() -> None:
    with open_session("pick_cube_franka") as session:
        intents: list[Trajectory | GraspSearch] = []
        session.ctx.events.subscribe(lambda e: intents.append(e.intent) if isinstance(e, Intended) else None)
        assert session.run().success
    searches = [intent for intent in intents if isinstance(intent, GraspSearch)]
    assert len(searches) == 1 and searches[0].chosen is not None
    assert len(intents) >= 4
    chosen = searches[0].candidates[searches[0].chosen]
    assert glyph(chosen).shape == (4, 2, 3)


@pytest.mark.slow
def test_a_sim_process_is_followed_with_its_paths_and_stopped() -> None:
    with SimProcess("--task", "stack_two") as sim, connect(sim.endpoint) as client:
        source = ConnectedSource(WorkcellHost(RemoteWorkcell(client.robot())))
        viewer = Viewer(source, 0)
        frames: list[Frame] = []
        news: list[object] = []
        viewer.control.listeners.append(news.append)
        clock = Clock()

        def take(frame: Frame) -> None:
            if np.abs(frame.seen.qd).max() > 0.05:
                clock.see(frame.seen.time)
            frames.append(frame)

        source.host.start()
        source.start(take, lambda loaded: None)
        try:
            wait_until(lambda: bool(frames), "a first frame")
            viewer.control.run(source.host.cell.task.prompt)
            wait_until(lambda: any(isinstance(item, Intended) for item in news), "a path")
            wait_until(lambda: frames[-1].seen.time > frames[0].seen.time + 2.0, "the arm moves")
            moving = [frame for frame in frames if np.abs(frame.seen.qd).max() > 0.05]
            viewer.control.stop()
            wait_until(lambda: any(isinstance(item, Came) for item in news), "the end")
            (came,) = [item for item in news if isinstance(item, Came)]
            assert came.result.data["reason"] == "cancelled"
            assert len(moving) > 20
            if clock.kept_real_time:
                assert len(moving) / (moving[-1].seen.time - moving[0].seen.time) >= 20.0
            wait_until(lambda: viewer.control.doing is Doing.NOTHING, "it is free again")
            viewer.control.back()
            wait_until(lambda: any(isinstance(item, Went) for item in news), "the way back")
        finally:
            source.stop()
            source.host.close()
            viewer.server.stop()


@contextmanager
def following(sim: SimProcess) -> Iterator[tuple[Viewer, list[Frame]]]:
    """Serve what a sim process does; what is drawn of it comes along."""
    with connect(sim.endpoint) as client:
        viewer = Viewer(ConnectedSource(WorkcellHost(RemoteWorkcell(client.robot()))), 0)
        frames: list[Frame] = []
        put = viewer.stream.put

        def take(frame: Frame) -> None:
            frames.append(frame)
            put(frame)

        viewer.stream.put = take  # type: ignore[method-assign]
        viewer.start()
        try:
            yield viewer, frames
        finally:
            viewer.stop()


@pytest.fixture(scope="module", params=["embedded", "connected"])
def steered(request: pytest.FixtureRequest) -> Iterator[Viewer]:
    if request.param == "embedded":
        yield request.getfixturevalue("three")
    else:
        with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim, following(sim) as (viewer, _):
            yield viewer


@dataclass(frozen=True)
class Steering:
    """What gives orders as the page does: one message each, over its websocket."""

    viewer: Viewer
    news: list[News]

    @property
    def board(self) -> str:
        """What the panel shows of the last order."""
        return next(panel for panel in self.viewer._hearing if isinstance(panel, PromptPanel))._board.content

    @property
    def offered(self) -> str:
        """What the panel offers for an answer."""
        return self.viewer._answers._form.content

    @property
    def held(self) -> str | None:
        return self.viewer.source.host.cell.observe().held

    def send(self, do: str, prompt: str = "", seed: int = 0) -> None:
        """Send an order, which is taken when this returns."""
        with websockets.sync.client.connect(self.viewer.url.replace("http", "ws") + "/order") as line:
            line.send(json.dumps({"do": do, "prompt": prompt, "seed": str(seed)}))
            assert line.recv() == ""

    def give(self, do: str, prompt: str = "") -> dict[str, Any]:
        """Send an order and wait for its end; return what came of it, as data."""
        del self.news[:]
        self.send(do, prompt)
        self.wait()
        came = [news for news in self.news if isinstance(news, Came)]
        return came[-1].result.data if came else {}

    def wait(self) -> None:
        wait_until(lambda: self.viewer.control.doing is Doing.NOTHING, "the end")


@pytest.fixture
def steering(steered: Viewer) -> Iterator[Steering]:
    news: list[News] = []
    steered.control.listeners.append(news.append)
    made = Steering(steered, news)
    made.give("reset")
    yield made
    steered.control.listeners.remove(news.append)


def done(came: dict[str, Any]) -> list[str]:
    return [step["call"] for step in came["done"]]


def test_a_question_is_answered_by_the_next_sentence_until_a_reset(steering: Steering) -> None:
    asked = steering.give("run", "pick up the cube")
    assert asked["refusal"]["candidates"] == ["red_cube", "green_cube", "blue_cube"]
    assert "Which one do you mean" in steering.board and 'value="green_cube"' in steering.offered
    assert done(steering.give("run", "the left one")) == ["pick(object=blue_cube)"]
    assert "pick up the cube" in steering.board and "Which one" in steering.board, "what the answer was to"
    assert steering.offered == ""
    assert done(steering.give("run", "put it on the green one")) == ["place_on(target=green_cube)"]
    steering.give("run", "pick up the cube")
    steering.give("reset")
    assert steering.offered == "" and "Which one" not in steering.board
    assert done(steering.give("run", "the left one")) == []


def test_an_answer_asks_for_what_the_question_came_up_for(steering: Steering) -> None:
    for do in ("plan", "simulate"):
        steering.give("reset")
        steering.give(do, "pick up the cube")
        assert f'name="do" value="{do}"' in steering.offered
        came = steering.give(do, "red_cube")
        assert came.get("plan") or came["would_work"] == ["pick(object=red_cube)"]
    assert steering.held is None


@pytest.mark.parametrize(
    ("written", "carried_out"),
    [
        ("pick(red_cube), home()", ["pick(object=red_cube)", "home()"]),
        ("move_to(x=0.2, y=0.1, z=0.3), close_gripper()", ["move_to(x=0.2, y=0.1, z=0.3)", "close_gripper()"]),
        ("holding(blue_cube)", ["pick(object=blue_cube)"]),
    ],
    ids=["calls", "hand moves", "goals"],
)
def test_what_is_written_out_is_carried_out(steering: Steering, written: str, carried_out: list[str]) -> None:
    assert done(steering.give("run", written)) == carried_out


def test_a_question_about_the_scene_is_answered_whichever_button_asks(steering: Steering) -> None:
    for do in ("run", "plan", "simulate"):
        assert "red_cube is on the table" in steering.give(do, "where is the red cube?")["answer"]
        assert "red_cube is on the table" in steering.board


def test_try_tells_what_would_come_of_a_sentence_and_moves_nothing(steering: Steering) -> None:
    tried = steering.give("simulate", "put the red cube on the blue cube")
    assert tried["ok"] and tried["would_work"] == ["pick(object=red_cube)", "place_on(target=blue_cube)"]
    assert "Tried on the twin" in steering.board and "then red_cube is on blue_cube" in steering.board
    assert steering.board.count("✓") == 2 and "nothing has moved" in steering.board
    assert steering.held is None and steering.viewer.source.host.cell.state().time == 0.0


def test_try_tells_what_would_fail(steering: Steering) -> None:
    tried = steering.give("simulate", "home(), move_to(x=3, y=0, z=0.3)")
    assert tried["would_fail"] == "move_to(x=3, y=0, z=0.3)" and tried["error"]["code"] == "unreachable"
    assert steering.board.count("✓") == 1 and steering.board.count("✗") == 1 and "would fail at plan" in steering.board


def test_judge_tells_whether_the_task_has_succeeded(steering: Steering) -> None:
    assert not steering.give("judge")["success"] and "state: no success" in steering.board
    steering.give("run", "pick(green_cube)")
    assert steering.give("judge")["success"] and "state: success" in steering.board
    assert "done:" not in steering.board, "a verdict that was asked for stands alone"


def test_step_back_undoes_what_was_ordered_last(steering: Steering) -> None:
    steering.give("run", "pick up the red cube")
    assert steering.held == "red_cube"
    steering.give("back")
    assert steering.held is None and "back to before: pick up the red cube" in steering.board


def test_who_waits_for_the_end_finds_everything_told(steering: Steering) -> None:
    control = steering.viewer.control
    told: list[Doing] = []
    control.listeners.append(lambda news: told.append(control.doing) if isinstance(news, Idle) else None)
    steering.give("judge")
    control.listeners.pop()
    assert len(told) == 1 and told[0] is not Doing.NOTHING


@contextmanager
def at_the_speed_of_the_clock(viewer: Viewer) -> Iterator[None]:
    session = viewer.source.host.cell
    if isinstance(session, RemoteWorkcell):
        session.robot.set_pace("realtime")
    yield
    if isinstance(session, RemoteWorkcell):
        session.robot.set_pace("fast")


@pytest.mark.parametrize("said", ["stop", "Halt!"])
def test_stop_said_while_it_moves_stops_it_and_is_told_as_no_failure(steering: Steering, said: str) -> None:
    with at_the_speed_of_the_clock(steering.viewer):
        steering.send("run", "pick up the red cube")
        wait_until(lambda: any(isinstance(news, PhaseEntered) for news in steering.news), "the arm moves")
        came = steering.give("run", said)
    assert came["reason"] == "cancelled" and steering.held is None
    assert "stopped: the arm holds" in steering.board and "■" in steering.board
    assert html.COLOURS["red"] not in steering.board and "failed" not in steering.viewer._strip._board.content
    assert not next(item for item in steering.viewer._hearing if isinstance(item, RepairsPanel))._folder.visible
    done_before = steering.board
    assert steering.give("run", said) == {} and steering.board == done_before, "nothing moves that could be stopped"


def test_stop_ends_a_trial(steering: Steering) -> None:
    began = threading.Event()
    steering.viewer.control.listeners.append(lambda news: began.set() if isinstance(news, Came) else None)
    steering.send("simulate", "put the red cube on the blue cube, then put the green cube on the red cube")
    assert began.wait(PATIENCE), "it is planned"
    steering.send("stop")
    steering.wait()
    steering.viewer.control.listeners.pop()
    assert "stopped: the arm holds" in steering.board and html.COLOURS["red"] not in steering.board


def test_answers_are_shown_as_text() -> None:
    assert "<b>" not in answer_form(["<b>"], "run")


@pytest.mark.slow
def test_a_connected_viewer_follows_when_another_client_loads_another_robot_and_task() -> None:
    arm = Path(__file__).parent / "toys" / "toy_jaw.xml"
    with (
        SimProcess("--task", "pick_cube_franka", "--allow-files", str(arm.parent)) as sim,
        connect(sim.endpoint) as other,
        following(sim) as (viewer, frames),
    ):
        wait_until(lambda: bool(frames), "a first frame")
        assert scene_names(viewer, "red_cube") and len(frames[-1].seen.q) == 7
        robot = other.robot()
        robot.load(task="put_in_drawer")
        wait_until(lambda: bool(scene_names(viewer, "drawer")), "the other task's scene")
        assert viewer.source.host.cell.task.name == "put_in_drawer"
        robot.send("open_drawer", {"drawer": "drawer"}).wait()
        opened = frames[-1].model.joint("object/drawer/box").qposadr[0]
        wait_until(lambda: float(frames[-1].qpos[opened]) > 0.05, "the drawer is drawn open")
        robot.load(task="pick_from_three", robot=str(arm))
        wait_until(lambda: bool(scene_names(viewer, "green_cube")), "the other robot's scene")
        assert not scene_names(viewer, "drawer")
        wait_until(lambda: len(frames[-1].seen.q) == 5, "frames of the other robot")
        assert viewer.source.blueprint.robot.n == 5
        # It is this robot that prompts now go to.
        viewer.control.run("go home")
        wait_until(lambda: viewer.control.doing is Doing.NOTHING, "the end")
        assert viewer.source.host.cell.robot_name == "toy_jaw"


def test_the_viewer_says_what_is_wrong_with_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, said in (
        (["--port", "70000"], "--port: 70000 is no port"),
        (["--task", "pick_cub_franka"], "did you mean 'pick_cube_franka'"),
        (["--connect", "tcp/127.0.0.1:1", "--task", "home"], "--task: a sim process has its own"),
    ):
        assert run_app(app, "robo-sandbox", ["viewer", *arguments]) == EXIT_USAGE
        assert said in capsys.readouterr().err


def test_a_taken_port_is_refused() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(InputError, match="cannot be had"):
            open_server(other.getsockname()[1], lambda order: "")


def test_a_recorded_episode_is_shown_state_by_state(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="needs the extra `record`")
    from robosandbox.apps.viewer.replay import recorded_frames
    from robosandbox.workcell.recording.episode import RecordedEpisode
    from robosandbox.workcell.recording.recorder import Recorder

    with open_session("home") as session:
        recorder = Recorder(tmp_path, session)
        recorder.follow()
        assert session.run().success
        ended = session.driver.state()
        recorder.close()
        assert recorder.last is not None
        playback = recorded_frames(RecordedEpisode.load(recorder.last), session)
        last = playback.frame(len(playback.seconds) - 1)
        assert np.allclose(last.seen.q, ended.q) and last.seen.time == pytest.approx(ended.time)
        assert playback.row(-1.0) == 0 and playback.row(playback.seconds[-1]) == len(playback.seconds) - 1
        assert playback.row(playback.seconds[3] + 0.001) == 3
        assert playback.said(len(playback.seconds) // 2).startswith("home: ")


def test_the_page_says_that_the_process_with_the_world_went_away() -> None:
    with serving("home") as viewer:
        prompt = next(item for item in viewer._hearing if isinstance(item, PromptPanel))
        viewer.control.tell(Presence("the sim of 'robot' went away"))
        assert "went away" in prompt._board.content and "ready" not in prompt._board.content
        viewer.control.tell(Presence(""))
        assert "went away" not in prompt._board.content and "ready" in prompt._board.content


def test_a_connected_viewer_says_when_its_sim_goes_away(capsys: pytest.CaptureFixture[str]) -> None:
    with (
        SimProcess("--task", "home") as sim,
        viewer_command._connected_source(Connection(connect=[sim.endpoint]), USUAL) as (source, _, link),
    ):
        viewer = Viewer(source, 0)
        prompt = next(item for item in viewer._hearing if isinstance(item, PromptPanel))
        link.tell = partial(viewer_command._tell_presence, viewer.control, link)
        viewer.start()
        try:
            sim.stop()
            wait_until(lambda: "went away" in prompt._board.content, "the page says so")
        finally:
            viewer.stop()
    assert "the sim of 'robot' went away" in capsys.readouterr().err
