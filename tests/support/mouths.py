"""The mouths of a workcell, asked for the same things: Python, the REPL, the viewer in a browser, MCP, JSON over Zenoh."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import threading
import time
import uuid
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from mcp import Client as McpClient
from mcp.client.stdio import StdioServerParameters
from playwright.sync_api import Browser, Page, sync_playwright
from support.processes import SimProcess, mcp_command, mcp_over_http

from robosandbox.agent.episode import Episode
from robosandbox.apps.commands.console import EXIT_DONE
from robosandbox.apps.repl.shell import Shell
from robosandbox.apps.viewer.app import Viewer
from robosandbox.apps.viewer.embedded import EmbeddedSource
from robosandbox.apps.viewer.news import Came, Complaint, Idle, News, Stopped
from robosandbox.apps.viewer.panels.prompt import PromptPanel
from robosandbox.driver import SafeDriver
from robosandbox.errors import RoboSandboxError
from robosandbox.types import Plan, Refusal, SkillCall, the_only
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.session import open_session
from robosandbox.workcell.workcell import Workcell
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

# Seconds within which anything that is asked for ends; to tell a hang.
PATIENCE = 120.0
CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
)
# WebGL on a CPU; the sandbox needs a user other than root.
CHROMIUM_FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox"]
# Speed of a joint, rad/s, of an arm that is on its way.
_MOVING = 0.05
# Far above the gap between two control ticks that a driver on the wall's clock allows.
_STALL_SECONDS = 0.5
# A driver on the wall's clock, whose watchdog sees that its process stood still.
HARDWARE = ("--driver", "hardware:clock=wall", "--perception", "rgbd", "--no-confirm")


@dataclass(frozen=True)
class Said:
    """What a mouth said: whether it was done, and its words."""

    ok: bool
    text: str


class Mouth(ABC):
    """Something through which a robot is asked."""

    def say(self, sentence: str) -> Said:
        """Carry out a sentence."""
        return self.order("run", prompt=sentence)

    def call(self, name: str, **arguments: Any) -> Said:
        """Carry out one call: a skill, or a move of the hand."""
        return self.say(str(SkillCall(skill=name, arguments=arguments)))

    def undo(self) -> Said:
        """Go back to before what was done last."""
        return self.order("undo")

    def recover(self) -> Said:
        """End a fault of the driver."""
        return self.order("recover")

    @abstractmethod
    def order(self, name: str, **arguments: Any) -> Said:
        """Carry out an order of `robosandbox.workcell.orders`."""

    @abstractmethod
    def reset(self, seed: int) -> Said:
        """Start over."""

    @abstractmethod
    def load(self, task: str) -> Said:
        """Put another task in the place of this one."""

    def stopped(self, sentence: str) -> Said:
        """Begin a sentence, and stop it when the arm is on its way; return how it ended."""
        with ThreadPoolExecutor(1) as other:
            saying = other.submit(self.say, sentence)
            while self.speed() < _MOVING:
                assert not saying.done(), "it has ended before it was stopped"
            self.stop()
            return saying.result(PATIENCE)

    def stalled(self, name: str, **arguments: Any) -> Said:
        """Begin a call, and let the process stand still that moves the arm; return how it ended."""
        with ThreadPoolExecutor(1) as other:
            calling = other.submit(lambda: self.call(name, **arguments))
            while self.speed() < _MOVING:
                assert not calling.done(), "it has ended before it stood still"
            self.stall()
            return calling.result(PATIENCE)

    @abstractmethod
    def stop(self) -> None:
        """Stop what runs, while another thread waits for its end."""

    @abstractmethod
    def speed(self) -> float:
        """Return the speed of the fastest joint, rad/s or m/s."""

    @abstractmethod
    def held(self) -> str | None:
        """Return what the robot holds."""

    @abstractmethod
    def task(self) -> str:
        """Return the loaded task's name."""

    @abstractmethod
    def tcp(self) -> tuple[float, ...]:
        """Return where the tool centre point is."""

    def stall(self) -> None:
        """Keep the process that moves the arm from doing so for half a second."""
        os.kill(self.pid(), signal.SIGSTOP)
        time.sleep(_STALL_SECONDS)
        os.kill(self.pid(), signal.SIGCONT)

    def pid(self) -> int:
        """Return the process that moves the arm."""
        raise NotImplementedError


class PythonMouth(Mouth):
    """A workcell in a program, of this process or of another one."""

    def __init__(self, cell: Workcell, pid: int | None = None) -> None:
        self.cell = cell
        self._pid = pid

    @property
    def _sim_here(self) -> SafeDriver:
        assert isinstance(self.cell, EmbeddedWorkcell)
        return self.cell.driver

    def say(self, sentence: str) -> Said:
        episode = self.cell.run(sentence)
        return Said(episode.success, episode.final_detail)

    def call(self, name: str, **arguments: Any) -> Said:
        return _tried(lambda: Said(True, str(self.cell.do(name, **arguments))))

    def order(self, name: str, **arguments: Any) -> Said:
        cell, steps = self.cell, Plan(steps=tuple(map(SkillCall.model_validate, arguments.get("steps", ()))))
        match name:
            case "plan":
                plan = cell.plan(arguments["prompt"])
                return Said(not isinstance(plan, Refusal), str(plan))
            case "check":
                problems = cell.check(steps)
                return Said(not problems, "; ".join(map(str, problems)))
            case "simulate":
                tried = cell.simulate(steps)
                return Said(tried["ok"], json.dumps(tried))
            case "achieve":
                return _ended(cell.achieve(*arguments["goals"]))
            case "follow":
                return _ended(cell.follow(steps))
            case "judge":
                return Said(cell.judge().success, "")
            case _:
                return _tried(lambda: Said(True, str(getattr(cell, name)())))

    def reset(self, seed: int) -> Said:
        self.cell.reset(seed)
        return Said(True, "")

    def load(self, task: str) -> Said:
        self.cell.load(task)
        return Said(True, "")

    def stop(self) -> None:
        self.cell.stop()

    def held(self) -> str | None:
        return self.cell.observe().held

    def task(self) -> str:
        return self.cell.task.name

    def tcp(self) -> tuple[float, ...]:
        return self.cell.state().tcp_pose.xyz

    def speed(self) -> float:
        return float(np.abs(self.cell.state().qd).max())

    def pid(self) -> int:
        assert self._pid is not None
        return self._pid

    def stopped(self, sentence: str) -> Said:
        if self._pid is not None:
            return Mouth.stopped(self, sentence)
        leave = _when_moving(self._sim_here, self.stop)
        try:
            return self.say(sentence)
        finally:
            leave()

    def stalled(self, name: str, **arguments: Any) -> Said:
        if self._pid is not None:
            return Mouth.stalled(self, name, **arguments)
        leave = _when_moving(self._sim_here, lambda: time.sleep(_STALL_SECONDS))
        try:
            return self.call(name, **arguments)
        finally:
            leave()


class ReplMouth(PythonMouth):
    """Lines of the REPL, as its shell takes them."""

    def __init__(self, cell: EmbeddedWorkcell) -> None:
        super().__init__(cell)
        self._shell = Shell(WorkcellHost(cell))

    def say(self, sentence: str) -> Said:
        outcome = self._shell.execute(sentence)
        return Said(outcome.code == EXIT_DONE, outcome.text)

    def call(self, name: str, **arguments: Any) -> Said:
        return Mouth.call(self, name, **arguments)

    def order(self, name: str, **arguments: Any) -> Said:
        calls = _as_calls(arguments)
        match name:
            case "achieve":
                return self.say(", ".join(arguments["goals"]))
            case "follow":
                return self.say(calls)
            case "judge":
                said = self.say("/judge")
                return Said("no success" not in said.text, said.text)
            case _:
                return self.say(f"/{name} {arguments.get('prompt', calls)}".strip())

    def reset(self, seed: int) -> Said:
        return self.say(f"/reset {seed}")

    def load(self, task: str) -> Said:
        return self.say(f"/load {task}")

    def stop(self) -> None:
        # "stop" that is typed while a line is carried out is Ctrl-C (apps/repl/typed_ahead.py).
        os.kill(os.getpid(), signal.SIGINT)


class McpMouth(Mouth):
    """Tools of an MCP server, called by the SDK's own client.

    Args:
        server: What the client connects to: a command, or an address.
        pid: Of the process that has the world.
    """

    def __init__(self, server: Any, pid: Callable[[], int]) -> None:
        self._pid = pid
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        self._leaving = asyncio.Event()
        self._client: Future[McpClient] = Future()
        self._visit = asyncio.run_coroutine_threadsafe(self._stay(server), self._loop)
        self._client.result(PATIENCE)

    async def _stay(self, server: Any) -> None:
        async with McpClient(server) as client:
            self._client.set_result(client)
            await self._leaving.wait()

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._leaving.set)
        self._visit.result(PATIENCE)
        self._loop.call_soon_threadsafe(self._loop.stop)

    def data(self, tool: str, **arguments: Any) -> dict[str, Any]:
        call = self._client.result().call_tool(tool, arguments)
        result = asyncio.run_coroutine_threadsafe(call, self._loop).result(PATIENCE)
        return {**result.structured_content, "is_error": result.is_error}

    def call(self, name: str, **arguments: Any) -> Said:
        data = self.data(name, **arguments)
        return Said(not data["is_error"], json.dumps(data))

    def order(self, name: str, **arguments: Any) -> Said:
        data = self.data(name, **arguments)
        return Said(_succeeded(data) and not data["is_error"], _in_words(data))

    def reset(self, seed: int) -> Said:
        return self.call("reset", seed=seed)

    def load(self, task: str) -> Said:
        return self.call("load", task=task)

    def stop(self) -> None:
        self.data("stop")

    def held(self) -> str | None:
        scene: dict[str, Any] = self.data("look")["scene"]
        return next((item["id"] for item in scene["objects"] if item.get("in") == "gripper"), None)

    def task(self) -> str:
        return str(self.data("reset")["task"])

    def tcp(self) -> tuple[float, ...]:
        return tuple(self.data("look")["state"]["tcp_pose"]["xyz"])

    def speed(self) -> float:
        return max(map(abs, self.data("look")["state"]["qd"]))

    def pid(self) -> int:
        return self._pid()


class JsonMouth(Mouth):
    """Keys of Zenoh and JSON, as a client without this package asks."""

    def __init__(self, session: zenoh.Session, pid: int) -> None:
        self._session = session
        self._pid = pid
        self._goal = ("", "")

    def ask(self, suffix: str, **message: Any) -> dict[str, Any]:
        (reply,) = self._session.get(
            f"robosandbox/robot/{suffix}", payload=json.dumps(message).encode(), timeout=PATIENCE
        )
        answer: dict[str, Any] = json.loads((reply.ok or reply.err).payload.to_bytes())  # type: ignore[union-attr]
        return {**answer, "is_error": reply.ok is None}

    def call(self, name: str, **arguments: Any) -> Said:
        return self.order(name, **arguments)

    def order(self, name: str, **arguments: Any) -> Said:
        goal_id = str(uuid.uuid4())
        goal = self.ask(f"skill/{name}/send_goal", goal_id=goal_id, arguments=arguments)
        self._goal = (name, goal_id)
        end = time.monotonic() + PATIENCE
        while goal.get("status") in ("accepted", "executing") and time.monotonic() < end:
            goal = self.ask(f"skill/{name}/get_result", goal_id=goal_id)
        return Said(goal.get("status") == "succeeded" and _succeeded(goal.get("answer") or {}), _in_words(goal))

    def reset(self, seed: int) -> Said:
        answer = self.ask("reset", seed=seed)
        return Said(not answer["is_error"], json.dumps(answer))

    def load(self, task: str) -> Said:
        answer = self.ask("load", task=task)
        return Said(not answer["is_error"], json.dumps(answer))

    def stop(self) -> None:
        name, goal_id = self._goal
        self.ask(f"skill/{name}/cancel_goal", goal_id=goal_id)

    def held(self) -> str | None:
        return next(filter(None, self.ask("obs/objects")["scene"]["hands"].values()), None)

    def task(self) -> str:
        return str(self.ask("info")["task"]["name"])

    def tcp(self) -> tuple[float, ...]:
        return tuple(self.ask("obs/state")["robot"]["arms"]["arm"]["tcp_pose"]["xyz"])

    def speed(self) -> float:
        return max(map(abs, self.ask("obs/state")["robot"]["arms"]["arm"]["qd"]))

    def pid(self) -> int:
        return self._pid


class ViewerMouth(PythonMouth):
    """The page of the viewer in a browser: what is typed there, which buttons are pressed, what is shown."""

    def __init__(self, viewer: Viewer, page: Page) -> None:
        super().__init__(viewer.source.host.cell)
        self._viewer = viewer
        self._page = page

    def press(self, button: str, prompt: str = "") -> Said:
        """Type a prompt, press a button, and return what the page shows when nothing is under way any more."""
        news: list[News] = []
        idle = threading.Event()

        def hear(told: News) -> None:
            news.append(told)
            if isinstance(told, Idle):
                idle.set()

        self._viewer.control.listeners.append(hear)
        self.click(button, prompt)
        assert idle.wait(PATIENCE), f"{button} has not ended"
        self._viewer.control.listeners.remove(hear)
        failed = [told for told in news if isinstance(told, Complaint | Stopped)]
        failed += [told for told in news if isinstance(told, Came) and not _succeeded(told.result.data)]
        panel = next(panel for panel in self._viewer._hearing if isinstance(panel, PromptPanel))
        shown = [*(text for text, _ in panel._steps), *(text for text, _ in panel._said)]
        self._page.get_by_text(shown[-1]).first.wait_for(timeout=1000 * PATIENCE)
        return Said(not failed, "; ".join(shown))

    def click(self, button: str, prompt: str = "") -> None:
        """Type a prompt, if any, and press a button."""
        if prompt:
            self._page.locator("input[name=prompt]").first.fill(prompt)
        self._page.get_by_role("button", name=button, exact=True).first.click()

    def say(self, sentence: str) -> Said:
        return self.press("Run", sentence)

    def call(self, name: str, **arguments: Any) -> Said:
        return Mouth.call(self, name, **arguments)

    def order(self, name: str, **arguments: Any) -> Said:
        prompt = arguments.get("prompt") or _as_calls(arguments) or ", ".join(arguments.get("goals", ()))
        buttons = {"undo": "Step back", "simulate": "Try", "achieve": "Run", "follow": "Run"}
        return self.press(buttons.get(name, name.capitalize()), prompt)

    def reset(self, seed: int) -> Said:
        self._page.locator("input[name=seed]").first.fill(str(seed))
        return self.press("Reset")

    def load(self, task: str) -> Said:
        page = self._page
        page.get_by_role("tab", name="World").click()
        box = page.locator("xpath=//label[normalize-space()='Task']/following::input[1]")
        box.click()
        page.get_by_role("option", name=task, exact=True).click()
        return self.press("Load")

    def stopped(self, sentence: str) -> Said:
        # However slowly the browser clicks: the arm waits on its way until the click is heard.
        clicked = threading.Event()
        leave = _when_moving(self._sim_here, lambda: clicked.wait(PATIENCE))
        idle = threading.Event()

        def hear(told: News) -> None:
            if isinstance(told, Idle):
                idle.set()

        self._viewer.control.listeners.append(hear)
        self.click("Run", sentence)
        self.click("Stop")
        clicked.set()
        self._page.get_by_text("stopped: the arm holds").wait_for(timeout=1000 * PATIENCE)
        assert idle.wait(PATIENCE)
        self._viewer.control.listeners.remove(hear)
        leave()
        return Said(False, "cancelled")


# How each is opened.


@contextmanager
def _python(*options: str) -> Iterator[Mouth]:
    with open_session(**_keywords(options)) as cell:
        yield PythonMouth(cell)


@contextmanager
def _repl(*options: str) -> Iterator[Mouth]:
    with open_session(**_keywords(options)) as cell:
        yield ReplMouth(cell)


_BROWSERS: list[Browser] = []


@contextmanager
def _chromium() -> Iterator[Browser]:
    """Open a browser, or the one that is open: a thread has one of Playwright's loops at a time."""
    if _BROWSERS:
        yield _BROWSERS[0]
        return
    with sync_playwright() as playwright:
        _BROWSERS.append(playwright.chromium.launch(executable_path=CHROMIUM, args=CHROMIUM_FLAGS))
        try:
            yield _BROWSERS[0]
        finally:
            _BROWSERS.pop().close()


@contextmanager
def _viewer(*options: str) -> Iterator[Mouth]:
    with _chromium() as browser, open_session(**_keywords(options), render_size=(120, 160)) as cell:
        viewer = Viewer(EmbeddedSource(WorkcellHost(cell, pace="watched" if "--realtime" in options else "fast")), 0)
        viewer.start()
        try:
            page = browser.new_page(viewport={"width": 800, "height": 900})
            page.goto(f"{viewer.url}/?fixedDpr=0.5")
            page.locator("input[name=prompt]").first.wait_for(timeout=1000 * PATIENCE)
            page.add_style_tag(content=".mantine-Notifications-root { display: none }")
            yield ViewerMouth(viewer, page)
            page.close()
        finally:
            viewer.stop()


@contextmanager
def _sim(*options: str) -> Iterator[SimProcess]:
    paced = "realtime" if "--realtime" in options else "fast"
    with SimProcess(*(one for one in options if one != "--realtime"), "--pace", paced) as sim:
        yield sim


@contextmanager
def _remote(*options: str) -> Iterator[Mouth]:
    with _sim(*options) as sim, connect(sim.endpoint) as client:
        yield PythonMouth(RemoteWorkcell(client.robot()), sim.pid)


@contextmanager
def _json(*options: str) -> Iterator[Mouth]:
    with _sim(*options) as sim, connect(sim.endpoint) as client:
        client.robot()
        yield JsonMouth(client.session, sim.pid)


@contextmanager
def _mcp(server: Any, pid: Callable[[], int]) -> Iterator[Mouth]:
    mouth = McpMouth(server, pid)
    try:
        yield mouth
    finally:
        mouth.close()


def _stdio(*options: str) -> StdioServerParameters:
    program, *arguments = mcp_command(*options)
    return StdioServerParameters(command=program, args=arguments)


@contextmanager
def _mcp_stdio(*options: str) -> Iterator[Mouth]:
    with _mcp(_stdio(*options), _newest_child) as mouth:
        yield mouth


@contextmanager
def _mcp_http(*options: str) -> Iterator[Mouth]:
    with mcp_over_http(*options) as url, _mcp(url, _newest_child) as mouth:
        yield mouth


@contextmanager
def _mcp_connect(*options: str) -> Iterator[Mouth]:
    with _sim(*options) as sim, _mcp(_stdio("--connect", sim.endpoint), lambda: sim.pid) as mouth:
        yield mouth


MOUTHS: dict[str, Callable[..., AbstractContextManager[Mouth]]] = {
    "python": _python,
    "remote": _remote,
    "repl": _repl,
    "viewer": _viewer,
    "mcp_stdio": _mcp_stdio,
    "mcp_http": _mcp_http,
    "mcp_connect": _mcp_connect,
    "json": _json,
}
"""What opens a mouth with options of the command line, by the name that docs/mouths.md has for it."""


def _keywords(options: tuple[str, ...]) -> dict[str, Any]:
    if "--realtime" in options:
        return {}
    if "--no-confirm" in options:
        return {"confirm": False, **_keywords(tuple(each for each in options if each != "--no-confirm"))}
    given = dict(zip(options[::2], options[1::2], strict=True))
    return {name.removeprefix("--"): value for name, value in given.items()}


def _newest_child() -> int:
    """Return the process that was started last by this one and serves MCP."""
    children = Path(f"/proc/{os.getpid()}/task").glob("*/children")
    pids = {int(pid) for file in children for pid in file.read_text().split()}
    return max(pid for pid in pids if b"\0mcp\0" in Path(f"/proc/{pid}/cmdline").read_bytes())


def _when_moving(sim: SafeDriver, act: Callable[[], object]) -> Callable[[], None]:
    """Call something once, in the driver's thread, when the arm is on its way; return what ends listening."""
    done: list[bool] = []

    def tick() -> None:
        if not done and float(np.abs(the_only(sim.arms, "arms").state().qd).max()) > _MOVING:
            done.append(True)
            act()

    return sim.subscribe(tick)


def _as_calls(arguments: dict[str, Any]) -> str:
    return ", ".join(str(SkillCall.model_validate(step)) for step in arguments.get("steps", ()))


def _succeeded(data: Mapping[str, Any]) -> bool:
    """Tell whether what came of an order is what was asked for."""
    return bool(data.get("success", data.get("ok", True))) and not data.get("refusal")


def _in_words(data: Mapping[str, Any]) -> str:
    """Return an answer as text, its calls as they are written."""
    inner = data.get("answer")
    answer = inner if isinstance(inner, dict) else data
    calls = [str(SkillCall.model_validate(step)) for step in answer.get("plan") or ()]
    return "; ".join([*calls, json.dumps(data)])


def _tried(act: Callable[[], Said]) -> Said:
    try:
        return act()
    except RoboSandboxError as error:
        return Said(False, str(error))


def _ended(episode: Episode) -> Said:
    return Said(episode.success, episode.final_detail)
