"""Programs of a model over the skills: what they can do, where they end, and that there is no way out of them."""

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pydantic_monty")

from support.listening import on_calls

from robosandbox.agent.episode import Episode
from robosandbox.agent.llm import endpoint_capabilities
from robosandbox.agent.llm.program import Program, ProgramEnd
from robosandbox.agent.planners import make_planner
from robosandbox.apps.conformance.openai_server import HttpAnswer, Script, ScriptedServer, fails, tool_calls
from robosandbox.errors import UnreachableError
from robosandbox.types import SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

NO_SCHEMA = fails(400, "no schema")
TAKES = {"pick": ["object"], "place_in": ["container"], "home": []}
FINISH = tool_calls(("finish", '{"summary": "Done."}'))
REFUSE = tool_calls(("refuse", '{"code": "impossible", "message": "No."}'))


def run(code: str) -> tuple[list[str], ProgramEnd, str]:
    """Return the calls of a program, each of which succeeds, how it ended, and what it printed."""
    program = Program(
        code, TAKES, {"scene": lambda: {"objects": [{"id": "a"}, {"id": "b"}]}, "holds": lambda text: True}
    )
    calls: list[str] = []
    at = program.begin()
    while isinstance(at, SkillCall) and len(calls) < 50:
        calls.append(str(at))
        at = program.go_on({"ok": True, "done": []})
    assert isinstance(at, ProgramEnd), calls
    return calls, at, program.printed


def test_a_loop_over_the_scene_calls_a_skill_for_each_thing() -> None:
    code = """
count = 0
for item in scene()["objects"]:
    pick(item["id"])
    if place_in(container="bin")["ok"]:
        count += 1
print("moved", count)
count
"""
    calls, end, printed = run(code)
    assert calls == ["pick(object=a)", "place_in(container=bin)", "pick(object=b)", "place_in(container=bin)"]
    assert end == ProgramEnd(value=2) and printed.strip() == "moved 2"


def test_the_program_of_the_page_runs() -> None:
    page = (Path(__file__).parents[1] / "docs" / "planners.md").read_text()
    code = page.partition("```text\nmoved = 0")[2].partition("```")[0]
    scene = {"objects": [{"id": "ball", "colour": "red"}, {"id": "cup", "colour": "blue"}]}
    program = Program(f"moved = 0{code}", {**TAKES, "place_in": ["container"]}, {"scene": lambda: scene, "holds": bool})
    assert str(program.begin()) == "ProgramEnd(value=0, error='')"
    program = Program(f"moved = 0{code}", TAKES, {"scene": lambda: scene, "holds": lambda text: False})
    assert str(program.begin()) == "pick(object=ball)"
    assert str(program.go_on({"ok": True})) == "place_in(container=red_bin)"
    assert program.go_on({"ok": True}) == ProgramEnd(value=1)


SECRET = "a secret of the host"

ESCAPES = {
    "open": "open({file!r}).read()",
    "open for writing": "open({new!r}, 'w').write('x')",
    "pathlib": "from pathlib import Path\nPath({file!r}).read_text()",
    "pathlib writes": "from pathlib import Path\nPath({new!r}).write_text('x')",
    "os.system": "import os\nos.system('touch {new}')",
    "os.listdir": "import os\nos.listdir('/')",
    "environment": "import os\nos.environ['ROBOSANDBOX_SECRET']",
    "getenv": "import os\nos.getenv('ROBOSANDBOX_SECRET')",
    "subprocess": "import subprocess\nsubprocess.run(['touch', {new!r}])",
    "socket": "import socket\nsocket.create_connection(('127.0.0.1', 22))",
    "__import__": "__import__('os').system('touch {new}')",
    "importlib": "import importlib\nimportlib.import_module('os').system('touch {new}')",
    "eval": "eval('open({file!r}).read()')",
    "exec": "exec('import os; os.system(\"touch {new}\")')",
    "compile": "exec(compile('open({file!r})', 'x', 'exec'))",
    "subclasses": "().__class__.__base__.__subclasses__()",
    "getattr": "getattr((), '__class__').__base__.__subclasses__()",
    "format": "'{{0.__class__.__init__.__globals__}}'.format(pick)",
    "globals of a skill": "pick.__globals__['os']",
    "globals of a function": "def f(): pass\nf.__globals__['__builtins__']",
    "code of a function": "def f(): pass\nf.__code__.co_consts",
    "frames": "import sys\nsys._getframe().f_back.f_globals",
    "modules": "import sys\nsys.modules['os'].system('touch {new}')",
    "traceback": "try:\n    1/0\nexcept Exception as e:\n    e.__traceback__.tb_frame.f_globals['os']",
    "generator frame": "g = (x for x in [1])\ng.gi_frame.f_back.f_globals",
    "builtins": "__builtins__['open']({file!r}).read()",
    "vars": "vars()['__builtins__']",
    "globals": "globals()['__builtins__']['open']({file!r})",
    "pickle": "import pickle\npickle.loads(b'cos\\nsystem\\n(S\"touch {new}\"\\ntR.')",
    "ctypes": "import ctypes\nctypes.CDLL(None).system(b'touch {new}')",
    "input": "input('password? ')",
    "breakpoint": "breakpoint()",
    "the interpreter of the host": "import pydantic_monty",
    "this package": "from robosandbox.agent import agent",
    "a result's attributes": "home().__class__.__mro__[-1].__subclasses__()",
}


@pytest.mark.parametrize("name", ESCAPES)
def test_there_is_no_way_out(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOSANDBOX_SECRET", SECRET)
    file, new = tmp_path / "secret.txt", tmp_path / "made"
    file.write_text(SECRET)
    calls, end, printed = run(ESCAPES[name].format(file=str(file), new=str(new)))
    assert end.error and not [call for call in calls if call != "home()"]
    assert SECRET not in json.dumps([end.error, str(end.value), printed])
    assert not new.exists() and file.read_text() == SECRET


BOMBS = {
    "no end": "while True: pass",
    "no end in a function": "def f():\n    while True: pass\nf()",
    "a long list": "x = [0]\nwhile True: x = x + x",
    "a long text": "'a' * 10**10",
    "a large number": "9 ** 9 ** 9",
    "a large range": "list(range(10**12))",
    "recursion": "def f(): return f()\nf()",
    "nesting": "(" * 5000 + ")" * 5000,
    "nested lists": "x = []\nfor i in range(10**7): x = [x]",
    "a sleep": "import time\ntime.sleep(1000)\nwhile True: pass",
    "looks without end": "while True: scene()",
    "printing without end": "while True: print('x' * 1000)",
    "a slow pattern": "import re\nre.match('(a+)+$', 'a' * 40 + 'b')\nwhile True: pass",
    "catching its own end": "while True:\n    try:\n        while True: pass\n    except BaseException: pass",
    "a cycle": "x = []\nx.append(x)\nwhile True: x = [x, x]",
}


@pytest.mark.parametrize("name", BOMBS)
def test_no_program_takes_long_or_much(name: str) -> None:
    begun = time.monotonic()
    calls, end, printed = run(BOMBS[name])
    assert not calls and end.error and len(end.error) <= 800 and len(printed) <= 2000
    # A bound against hanging, far above what the interpreter is told.
    assert time.monotonic() - begun < 30.0


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("pick()", ""),
        ("pick('a', 'b')", "pick takes object"),
        ("pick('a', object='b')", "pick takes object"),
        ("pick(['a'])", "object is a list"),
        ("pick({'a': 1})", "object is a dict"),
        ("pick(None)", "object is a NoneType"),
        ("elephant()", "there is no 'elephant' in a program; there is pick"),
        ("pick('a'", "SyntaxError"),
        ("1 / 0", "ZeroDivisionError"),
        ("raise ValueError('so')", "so"),
        ("x = 1\nx.missing", "line 2"),
    ],
)
def test_what_is_wrong_with_a_program_is_told(code: str, told: str) -> None:
    calls, end, _ = run(code)
    assert told in end.error and (calls == ["pick()"] if code == "pick()" else not calls)


def test_the_same_program_comes_to_the_same_calls() -> None:
    code = "import random\npick(str(random.random()))"
    assert run(code)[0] == run(code)[0]


# In a world.


@pytest.fixture(scope="module")
def _world() -> Iterator[EmbeddedWorkcell]:
    with open_session("put_in_bin", what_if=False) as session:
        yield session


@pytest.fixture
def world(_world: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch) -> EmbeddedWorkcell:
    monkeypatch.setattr(endpoint_capabilities, "_PROCESS_CACHE", endpoint_capabilities.EndpointCache())
    _world.reset()
    return _world


def program(code: str) -> HttpAnswer:
    return tool_calls(("program", json.dumps({"code": code})))


def act(world: EmbeddedWorkcell, server: ScriptedServer, mode: str = "code", **options: Any) -> Episode:
    told = {"model": "scripted", "base_url": server.url, "mode": mode, **options}
    world.agent.planner = make_planner("openai", list(world.skills), told)
    return world.run("frobnicate the cube")


def told(server: ScriptedServer) -> dict[str, Any]:
    """Return what the last request says of the program."""
    return dict(json.loads(server.requests[-1]["messages"][-1]["content"]))


BOTH = 'pick("red_cube")\nplace_in("grey_bin")\nholds("inside(red_cube, grey_bin)")'


def test_a_program_is_carried_out_call_by_call_and_told_with_its_value(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(NO_SCHEMA, program(BOTH), FINISH) as server:
        episode = act(world, server)
        assert episode.success and [step.call.skill for step in episode.steps] == ["pick", "place_in"]
        assert told(server)["value"] is True and len(told(server)["done"]) == 2
    assert world.judge().success and [one.tool for one in episode.consulted] == ["program"]


def test_without_the_mode_there_is_no_such_tool(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(NO_SCHEMA, program(BOTH), REFUSE) as server:
        episode = act(world, server, mode="act")
        names = {tool["function"]["name"] for tool in server.requests[-1]["tools"]}
    assert "program" not in names and not episode.steps


@pytest.mark.parametrize(
    ("code", "why", "done"),
    [
        ('place_in("grey_bin")', "the gripper is empty", 0),
        ('pick("elephant")', "elephant", 0),
        ('pick("red_cube")\npick("grey_bin")\nhome()', "the gripper holds red_cube", 1),
        ('pick("red_cube")\nimport os\nos.system("x")', "system", 1),
    ],
)
def test_a_call_that_the_check_turns_down_ends_the_program(
    world: EmbeddedWorkcell, code: str, why: str, done: int
) -> None:
    begun: list[SkillCall] = []
    leave = on_calls(world.ctx.events, begun.append)
    with ScriptedServer(NO_SCHEMA, program(code), REFUSE) as server:
        episode = act(world, server)
        answer = told(server)
    leave()
    assert not answer["ok"] and why in json.dumps(answer) and len(answer["done"]) == done == len(begun)
    assert episode.refusal is not None


def test_what_is_forbidden_stays_forbidden_and_steps_are_bounded(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(NO_SCHEMA, program('pick("red_cube")'), REFUSE) as server:
        told_ = {"model": "scripted", "base_url": server.url, "mode": "code"}
        world.agent.planner = make_planner("openai", list(world.skills), told_)
        assert not world.run("frobnicate it without touching the red cube").steps
    endless = "while True:\n    home()\n"
    with ScriptedServer(NO_SCHEMA, program(endless), REFUSE) as server:
        episode = act(world, server, max_steps=3)
        assert "at most 3 calls" in told(server)["error"]
    assert len(episode.steps) == 3


def test_a_failure_ends_the_program_and_the_model_goes_on(world: EmbeddedWorkcell) -> None:
    def refuse(one: SkillCall) -> None:
        leave()
        raise UnreachableError(f"{one}: out of reach")

    def spoil(body: dict[str, Any]) -> HttpAnswer:
        nonlocal leave
        del body
        leave = on_calls(world.ctx.events, refuse)
        return program(BOTH)

    def leave() -> None: ...

    script: list[Script] = [NO_SCHEMA, spoil, program(BOTH), FINISH]
    with ScriptedServer(*script) as server:
        episode = act(world, server)
        failed = json.loads(server.requests[2]["messages"][-1]["content"])
    assert failed["error"]["code"] == "unreachable" and failed["done"] == [] and not failed["ok"]
    assert episode.success and episode.replans == 1


def test_each_call_of_a_program_is_shown_to_the_person_first(world: EmbeddedWorkcell) -> None:
    shown: list[str] = []
    world.agent.approve = lambda plan: bool(shown.append(str(plan))) or len(shown) < 2
    try:
        with ScriptedServer(NO_SCHEMA, program(BOTH), FINISH) as server:
            episode = act(world, server)
    finally:
        world.agent.approve = None
    assert len(shown) == 2 and episode.final_reason == "declined" and len(episode.steps) == 1
    assert _children() == 0


def _children() -> int:
    """Return how many interpreters of programs this process has left behind."""
    found = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stat = (folder / "stat").read_text()
        except OSError:
            continue
        name, _, rest = stat.rpartition(")")
        found += rest.split()[1] == str(os.getpid()) and "monty" in name and rest.split()[0] != "Z"
    return found
