"""The REPL, as a person at a terminal and as a program at a pipe meet it."""

import os
import re
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pexpect
import pyte
import pytest

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, EXIT_UNAVAILABLE, EXIT_USAGE, run_app
from robosandbox.apps.conformance.openai_server import HttpAnswer, ScriptedServer, fails, plan
from robosandbox.apps.repl.completion import endings, verbs_for
from robosandbox.apps.repl.history import open_history
from robosandbox.apps.repl.link import Link
from robosandbox.apps.repl.shell import Shell
from robosandbox.apps.repl.showing import object_names, scene_table
from robosandbox.cache import state_file
from robosandbox.errors import CancelledError, RenderingError
from robosandbox.types import DetectedObject, ObservedScene, Pose
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.session import open_session
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

PROGRAM = (sys.executable, "-c", "from robosandbox.apps.cli import main; main()")
PATIENCE = 60

# A planner that thinks for ever, or plans more work than a test has time for.
SLOW_PLANNER = """\
import threading
from robosandbox.agent.planner import StubPlanner
from robosandbox.types import Plan, SkillCall


class Slow(StubPlanner):
    def plan(self, prompt, scene, history=()):
        if prompt == "think":
            print("thinking", flush=True)
            threading.Event().wait()
        if prompt == "toil":
            pick = SkillCall(skill="pick", arguments={"object": "red_cube"})
            place = SkillCall(skill="place_at", arguments={"x": 0.1, "y": -0.16})
            return Plan(steps=(pick, place) * 200)
        if prompt == "break":
            raise RuntimeError("a fault of the planner")
        return super().plan(prompt, scene, history)
"""


class Person:
    """Somebody at a terminal of 30 lines of 160 characters."""

    def __init__(self, state: Path, *options: str, python_path: Path | None = None, reports: bool = False) -> None:
        environment = {**os.environ, "TERM": "xterm-256color", "XDG_STATE_HOME": str(state)}
        if python_path is not None:
            environment["PYTHONPATH"] = str(python_path)
        if not reports:
            environment["PROMPT_TOOLKIT_NO_CPR"] = "1"
        self.screen = pyte.Screen(160, 30)
        self.child = pexpect.spawn(
            PROGRAM[0],
            [*PROGRAM[1:], "repl", *options],
            env=environment,
            encoding="utf-8",
            timeout=PATIENCE,
            dimensions=(30, 160),
            echo=False,
        )
        # Where the cursor is: what terminals answer, and what the status bar waits for.
        self.screen.write_process_input = self.child.send
        self._stream = pyte.Stream(self.screen)
        self.child.logfile_read = self
        self.sees("/help helps")
        self.is_asked()

    def write(self, text: str) -> None:
        self._stream.feed(text)

    def flush(self) -> None:
        pass

    def types(self, text: str) -> None:
        self.child.send(text)

    def says(self, line: str, answer: str) -> None:
        """Type a line, wait for what it must bring, and for the next prompt."""
        self.types(f"{line}\r")
        self.sees(answer)
        self.is_asked()

    def sees(self, text: str) -> None:
        """Wait for text that comes next."""
        self.child.expect_exact(text)

    def is_asked(self) -> None:
        """Wait until the prompt reads keys: it has pastes bracketed then."""
        self.sees("\x1b[?2004h")

    def has_on_screen(self, text: str) -> None:
        """Wait until the screen shows text, however it was drawn."""
        deadline = time.monotonic() + PATIENCE
        while text not in "\n".join(self.screen.display):
            assert time.monotonic() < deadline, "\n".join(line.rstrip() for line in self.screen.display)
            if select.select([self.child.child_fd], [], [], 1.0)[0]:
                self.child.expect(r"(?s).+")

    def finds(self, object_id: str) -> tuple[float, float, float]:
        """Ask where an object is."""
        self.types("/scene\r")
        self.child.expect(rf"{object_id} +\S+ +\S+ +\d+ x \d+ x \d+ +(\S+) +(\S+) +(\S+)\s")
        found = tuple(float(self.child.match[index]) for index in (1, 2, 3))
        self.is_asked()
        return found

    def leaves(self, keys: str = "\x04") -> int:
        """Leave; return the exit code."""
        self.types(keys)
        self.child.expect(pexpect.EOF)
        self.child.close()
        return self.child.exitstatus


@pytest.fixture
def people(tmp_path):
    """Return a way to seat people at terminals; they are sent home after the test."""
    seated = []

    def seat(*options: str, **more) -> Person:
        seated.append(Person(tmp_path / "state", *options, **more))
        return seated[-1]

    yield seat
    for person in seated:
        person.child.close(force=True)


@pytest.fixture(scope="module")
def slow_planner(tmp_path_factory) -> Path:
    """Return a folder with an installed planner `slow`."""
    folder = tmp_path_factory.mktemp("plugins")
    (folder / "slow_planner.py").write_text(SLOW_PLANNER)
    installed = folder / "slow_planner-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: slow-planner\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text("[robosandbox.planners]\nslow = slow_planner:Slow\n")
    return folder


def free_endpoint() -> str:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{found.getsockname()[1]}"


@contextmanager
def sim_process(endpoint: str, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A real sim, ready for clients."""
    process = subprocess.Popen(
        [*PROGRAM, "sim", "--listen", endpoint, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert process.stdout is not None and process.stdout.readline().startswith("listening on")
        yield process
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    where = free_endpoint()
    with sim_process(where):
        yield where


def pipe(lines: str, *options: str, **more) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*PROGRAM, "repl", *options], input=lines, capture_output=True, text=True, timeout=PATIENCE, **more
    )


# At a terminal, in an embedded world.


def test_a_question_is_answered_in_the_next_line_and_undo_brings_the_cube_back(people):
    person = people()
    before = person.finds("red_cube")
    person.says("pick up the cube", "refused: Which one")
    person.says("the red one", "done: pick(object=red_cube)")
    person.says("no, the green one", "pick(object=green_cube)")
    assert person.finds("green_cube")[2] > before[2] + 0.05
    person.says("/undo", "undone: no, the green one")
    person.says("/undo", "undone: the red one")
    assert person.finds("red_cube") == pytest.approx(before, abs=1e-3)
    person.says("/undo", "nothing to undo")
    assert person.leaves() == EXIT_DONE


def test_ctrl_c_stops_a_goal_or_an_endless_thought_and_leaves_the_conversation(people, slow_planner):
    person = people("--planner", "slow", python_path=slow_planner)
    person.types("toil\r")
    person.sees("done")
    person.types("\x03")
    person.sees("cancelled: ")
    person.sees("the arm holds where it was")
    person.is_asked()
    person.says("/undo", "undone: toil")
    person.types("think\r")
    person.sees("thinking")
    person.types("\x03")
    person.sees("cancelled: nothing has moved")
    person.is_asked()
    person.says("break", "ended in a fault of the code (RuntimeError)")
    person.says("pick up the blue cube", "done: pick(object=blue_cube)")
    assert person.leaves("/quit\r") == EXIT_DONE


def test_stop_typed_while_it_moves_stops_it_and_other_lines_wait_their_turn(people, slow_planner):
    person = people("--planner", "slow", python_path=slow_planner)
    person.types("toil\r")
    person.sees("done")
    person.types("stop\r")
    person.sees("cancelled: ")
    person.is_asked()
    person.types("think\r")
    person.sees("thinking")
    person.types("Stop!\r")
    person.sees("cancelled: nothing has moved")
    person.is_asked()
    person.types("go home\rhow many cubes are there?\r")
    person.sees("done: home()")
    # Whoever has read the second line, the terminal or the prompt, it is answered.
    person.sees("3: ")
    person.is_asked()
    assert person.leaves() == EXIT_DONE


def test_a_robot_is_checked_tried_and_judged_in_the_conversation():
    with open_session("pick_from_three") as session:
        shell = Shell(WorkcellHost(session))
        told, seconds = shell.execute("/simulate pick up the green cube").text.splitlines()
        assert re.fullmatch(
            r"pick\(object=green_cube\): would work; \d\.\d s, touches green_cube, \d+ mm from \w+ at the nearest", told
        )
        assert re.fullmatch(r"\d\.\d simulated seconds", seconds)
        assert shell.execute("/check").text == "pick(object=green_cube): nothing speaks against it"
        assert "gripper is empty" in shell.execute("/check place_on(target=green_cube)").text
        assert shell.execute("/judge").text.startswith("pick_from_three: no success yet")
        assert shell.execute("move_to(x=0.2, y=0.0, z=0.4)").text == "done: move_to(x=0.2, y=0.0, z=0.4)"
        assert shell.execute("holding(green_cube)").text == "done: pick(object=green_cube)"
        assert shell.execute("holding(green_cube)").text == "It is so already: holding(green_cube)."


@pytest.mark.slow
def test_a_model_is_talked_to_ctrl_c_stops_its_thinking_and_its_faults_are_a_line(people):
    modes = pytest.importorskip("robosandbox.agent.llm.modes")
    picks = plan(("pick", {"object": "red_cube"}))
    stalled = HttpAnswer(body=picks.body, send=20, then="stall")
    # Each way of asking is tried, and refused.
    refusals = [fails(400, "no such field")] * len(modes.Mode)
    with ScriptedServer(stalled, stalled, picks, *refusals) as server:
        person = people("--planner", "openai", "--model", "scripted", "--base-url", server.url)
        for line in ("pick up the red cube", "/plan pick up the red cube"):
            asked = len(server.requests)
            person.types(f"{line}\r")
            while len(server.requests) == asked:
                time.sleep(0.02)
            # The answer stalls for good, so that only the key can end it.
            person.types("\x03")
            person.sees("cancelled")
            person.is_asked()
        person.says("pick up the red cube", "done: pick(object=red_cube)")
        person.says("/plan put it down", "does not take the request: HTTP 400: no such field")
        assert "fault" not in "\n".join(person.screen.display)
        assert person.leaves() == EXIT_DONE


def test_tab_completes_verbs_objects_and_commands_and_ctrl_c_drops_the_line(people):
    person = people()
    for keys, shown in (("fet\t", "> fetch"), ("/und\t", "> /undo"), ("pick up the blu\t", "> pick up the blue")):
        person.types(keys)
        person.has_on_screen(shown)
        person.types("\x03")
        person.is_asked()
    person.says("/log", "nothing was said yet")
    person.says("pick up the cube", "Which one")
    person.types("\t")
    person.has_on_screen("  green_cube")


def test_the_status_bar_tells_what_is_held(people):
    person = people(reports=True)
    person.has_on_screen("pick_from_three | panda | holds nothing")
    person.types("pick up the red cube\r")
    person.has_on_screen("pick_from_three | panda | holds red_cube")


@pytest.mark.slow
def test_lines_are_remembered_from_one_conversation_to_the_next(people):
    first = people()
    first.says("/plan go home", "1. home()")
    assert first.leaves() == EXIT_DONE
    second = people()
    second.types("\x1b[A")
    second.has_on_screen("> /plan go home")


# At a terminal, with a sim process.


@pytest.mark.slow
def test_a_remote_robot_is_talked_to_in_the_same_way(people, endpoint):
    person = people("--connect", endpoint)
    person.says("/reset 0", "reset: pick_from_three with seed 0")
    before = person.finds("red_cube")
    person.says("pick up the cube", "refused: Which one")
    person.types("the red one\r")
    person.sees("pick(object=red_cube): approach")
    person.types("\x03")
    person.sees("cancelled: ")
    person.is_asked()
    person.says("pick up the red cube", "done: pick(object=red_cube)")
    assert person.finds("red_cube")[2] > before[2] + 0.05
    person.says("/undo", "undone: pick up the red cube")
    person.says("/undo", "undone: the red one")
    assert person.finds("red_cube") == pytest.approx(before, abs=2e-3)
    person.says("/cancel", "nothing runs")
    assert person.leaves() == EXIT_DONE


@pytest.mark.slow
def test_a_sim_that_dies_is_waited_for_and_the_work_goes_on(people, tmp_path):
    where, state = free_endpoint(), str(tmp_path / "state.json")
    with sim_process(where, "--state-file", state) as sim:
        person = people("--connect", where)
        person.types("pick up the red cube\r")
        person.sees("pick(object=red_cube): descend")
        sim.kill()
        person.sees("the sim of 'robot' went away")
    with sim_process(where, "--state-file", state, "--pace", "fast"):
        person.sees("the sim of 'robot' is back")
        person.sees("done: pick(object=red_cube)")
        person.is_asked()
        person.says("/undo", "the sim does not have the state before it any more; reset starts over")
    person.sees("the sim of 'robot' went away")
    person.types("/scene\r")
    person.sees("\x1b[?2004l")
    person.types("\x03")
    person.is_asked()
    assert person.leaves() == EXIT_UNAVAILABLE


def test_what_others_asked_for_can_be_cancelled_and_a_reset_undone(endpoint):
    with connect(endpoint) as other, connect(endpoint) as client:
        robot = client.robot()
        session = RemoteWorkcell(robot, WorkcellOptions(dialogue=True))
        shell = Shell(WorkcellHost(session), Link(client, robot))
        goal = other.robot().send("pick", {"object": "red_cube"})
        assert any(feedback is not None for feedback in goal.follow())
        assert shell.execute("/cancel").text == "cancelled: pick"
        with pytest.raises(CancelledError):
            goal.wait(PATIENCE)
        assert shell.execute("/reset 3").text == "reset: pick_from_three with seed 3"
        start = session.start
        assert shell.execute("/reset 4").code == EXIT_DONE and session.seed == 4
        assert shell.execute("/undo").text == "undone: reset to seed 4"
        assert session.seed == 3 and session.start is start


# At a pipe.


def test_a_pipe_gets_an_answer_a_line_and_no_escape_codes(tmp_path):
    done = pipe(
        "# a comment\n\n  pick up the red cube\nput it on the green one\n/plan go home\n/undo\n/quit\nnever said\n"
    )
    assert done.returncode == EXIT_DONE
    assert done.stdout.splitlines() == [
        "done: pick(object=red_cube)",
        "done: place_on(target=green_cube)",
        "1. home()",
        "undone: put it on the green one",
    ]
    assert "\x1b" not in done.stdout + done.stderr


def test_one_line_that_fails_makes_the_exit_code_1_and_the_rest_is_done():
    done = pipe("dance\n/scnee\ngo home\n")
    assert done.returncode == EXIT_FAILED
    refused, wrong, home = done.stdout.splitlines()
    assert refused.startswith("refused: ") and home == "done: home()"
    assert wrong == "no command '/scnee'; did you mean '/scene'?"


@pytest.mark.slow
def test_ctrl_c_at_a_pipe_stops_the_arm_and_the_program(slow_planner):
    with subprocess.Popen(
        [*PROGRAM, "repl", "--planner", "slow"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(slow_planner)},
    ) as program:
        assert program.stdin and program.stdout and program.stderr
        program.stdin.write("toil\ngo home\n")
        program.stdin.flush()
        while "done" not in program.stderr.readline():
            pass
        program.send_signal(signal.SIGINT)
        out, _ = program.communicate(timeout=PATIENCE)
    assert out.startswith("cancelled: ") and "home" not in out and program.returncode == 130


@pytest.mark.slow
def test_a_sim_that_never_returns_ends_a_pipe_with_exit_3():
    where = free_endpoint()
    with (
        sim_process(where, "--pace", "fast") as sim,
        subprocess.Popen(
            [*PROGRAM, "repl", "--connect", where, "--reconnect", "0.2"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as program,
    ):
        assert program.stdin and program.stdout
        program.stdin.write("pick up the red cube\n")
        program.stdin.flush()
        assert program.stdout.readline() == "done: pick(object=red_cube)\n"
        sim.kill()
        sim.wait()
        out, err = program.communicate("go home\n/scene\n", timeout=PATIENCE)
    assert program.returncode == EXIT_UNAVAILABLE
    assert out.count("\n") == 1 and "the sim of 'robot'" in out
    assert "the sim of 'robot' went away" in err and "Traceback" not in err


@pytest.mark.parametrize(
    ("options", "code", "named"),
    [
        (["--task", "stack_tow"], EXIT_USAGE, "did you mean 'stack_two'"),
        (["--seed", "-1"], EXIT_USAGE, "--seed: -1 is negative"),
        (["--max-replans", "-1"], EXIT_USAGE, "--max-replans: -1 is negative"),
        (["--reconnect", "nan"], EXIT_USAGE, "--reconnect: nan is not within 0..86400"),
        (["--planner", "stubb"], EXIT_USAGE, "did you mean 'stub'"),
        (["--connect", "tcp/127.0.0.1:1", "--task", "home"], EXIT_USAGE, "--task: a sim process has its own"),
        (["--connect", "nowhere"], EXIT_USAGE, "--connect"),
    ],
)
def test_wrong_options_are_one_line(options, code, named, capsys):
    assert run_app(app, "robo-sandbox", ["repl", *options]) == code
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and named in err


# Lines and what comes of them.


@pytest.fixture(scope="module")
def shell() -> Iterator[Shell]:
    with open_session(dialogue=True) as session:
        yield Shell(WorkcellHost(session))


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("/log", "nothing was said yet"),
        ("/plan", "no plan yet"),
        ("/plan dance", "refused (unsupported): "),
        ("/scene now", "/scene: takes nothing after it, got 'now'"),
        ("/reset -1", "/reset: '-1' is no seed; give a whole number from 0"),
        ("/reset ²", "/reset: '²' is no seed"),
        ("/log 0", "/log: '0' is no number of lines"),
        ("/photo", "/photo: takes a file"),
        ("/photo 'x", "/photo: no closing quotation"),
        ("/photo x.gif", "/photo: 'x.gif' is no picture's name; end it in .png or .jpg"),
        ("/photo gone/x.png", "/photo: there is no folder 'gone'; make it first"),
        ("/photo x.png tpo", "did you mean 'top'?"),
        ("/qiut", "did you mean '/quit'"),
        ("/", "no command '/'; /help lists them"),
        ("x" * 10_000_000, "at most 4,000"),
    ],
)
def test_every_slip_is_answered_in_a_line(shell, line, answer):
    outcome = shell.execute(line)
    assert answer in outcome.text and "\n" not in outcome.text and len(outcome.text) < 300
    assert not outcome.leave


def test_words_of_other_programs_leave_and_help_too(shell):
    assert shell.execute("exit").leave and shell.execute("/q").leave
    assert "/photo FILE [CAMERA]" in shell.execute("help").text
    assert "place_on(target)" in shell.execute("/skills").text


def test_reset_is_undone_like_everything_else():
    with open_session() as session:
        shell = Shell(WorkcellHost(session))
        before = session.observe().objects
        assert shell.execute("/reset 3").text == "reset: pick_from_three with seed 3"
        assert session.observe().objects != before and session.seed == 3
        assert shell.execute("/undo").text == "undone: reset to seed 3"
        assert session.seed == 0
        assert [item.pose for item in session.observe().objects] == [item.pose for item in before]
        assert "/undo -> undone: reset to seed 3" in shell.execute("/log").text


def test_a_photo_without_opengl_is_a_line_with_the_remedy(shell, monkeypatch, tmp_path):
    monkeypatch.setattr(
        "robosandbox.sim.rendering._context_class", lambda backend: (_ for _ in ()).throw(ImportError("x"))
    )
    outcome = shell.execute(f"/photo {tmp_path}/x.png")
    assert outcome.code == EXIT_FAILED and "apt-get install" in outcome.text and "\n" not in outcome.text


@pytest.mark.gl
def test_photos_are_of_the_kind_that_their_names_say(tmp_path):
    with open_session() as session:
        shell = Shell(WorkcellHost(session))
        try:
            session.picture("scene")
        except RenderingError as error:
            pytest.skip(str(error))
        assert shell.execute(f"/photo '{tmp_path}/a picture.png'").text == f"scene -> {tmp_path}/a picture.png"
        assert shell.execute(f"/photo {tmp_path}/b.JPG top").text == f"top -> {tmp_path}/b.JPG"
    assert (tmp_path / "a picture.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "b.JPG").read_bytes().startswith(b"\xff\xd8")


def test_a_text_goes_on_with_the_phrases_that_it_began():
    names = ["red cube", "red_cube", "pick up"]
    assert list(endings("put it on the red c", names)) == [("red cube", 5)]
    assert list(endings("red", names)) == [("red cube", 3), ("red_cube", 3)]
    assert [phrase for phrase, _ in endings("pick up ", names)] == names
    assert list(endings("pic", names)) == [("pick up", 3)]
    assert list(endings("fred", names)) == []


def test_verbs_are_those_of_the_robots_skills():
    assert {"pick up", "put", "swap", "go home"} <= {*verbs_for(["pick", "place_on", "home"])}
    assert {*verbs_for(["push"])} >= {"push"} and "pick up" not in verbs_for(["push"])
    assert "wave at somebody" in verbs_for(["wave_at_somebody"])


def test_every_kind_of_object_is_shown_with_its_full_size():
    sizes = {
        "box": ((0.01, 0.02, 0.03), "20 x 40 x 60"),
        "sphere": ((0.02,), "diameter 40"),
        "cylinder": ((0.02, 0.03), "diameter 40, height 60"),
        "capsule": ((0.02, 0.03), "diameter 40, length 100"),
        "mesh": ((0.01, 0.02, 0.03), "20 x 40 x 60"),
        "bin": ((0.05, 0.06, 0.07), "100 x 120 x 70"),
        "bowl": ((0.05, 0.04), "diameter 100, height 40"),
        "drawer": ((0.2, 0.1, 0.05, 0.08), "100 x 200 x 50"),
    }
    objects = tuple(
        DetectedObject(
            id=kind, kind=kind, size=size, colour="red", rgba=(1, 0, 0, 1), pose=Pose(xyz=(0.1, -0.0001, 0.05))
        )
        for kind, (size, _) in sizes.items()
    )
    scene = ObservedScene(time=0.0, objects=objects, table_height=0.04, base_xy=(0.0, 0.0), hands={"hand": "bowl"})
    rows = scene_table(scene).splitlines()[1:]
    for row, (kind, (_, shown)) in zip(rows, sizes.items(), strict=True):
        assert re.fullmatch(rf"{kind} +red +{kind} +{shown} +\+0\.100 +\+0\.000 +\+0\.050( +held)?", row), row
    assert [row.endswith("held") for row in rows].count(True) == 1
    assert {"red ball", "red bin", "bowl"} <= {*object_names(objects)}


@pytest.mark.slow
def test_history_is_where_xdg_has_it_and_a_read_only_disk_is_no_hindrance(tmp_path):
    assert state_file("history", {"XDG_STATE_HOME": "/somewhere"}) == Path("/somewhere/robosandbox/history")
    assert state_file("history", {"XDG_STATE_HOME": "not/absolute"}) == Path.home() / ".local/state/robosandbox/history"
    kept = open_history(tmp_path / "new" / "history")
    kept.append_string("go home")
    assert "go home" in (tmp_path / "new" / "history").read_text()
    assert (tmp_path / "new" / "history").stat().st_mode & 0o777 == 0o600
    (tmp_path / "file").write_text("")
    open_history(tmp_path / "file" / "history").append_string("kept in memory")
    (tmp_path / "new" / "history").unlink()
    (tmp_path / "new" / "history").mkdir()
    kept.append_string("the disk is gone")
