"""What people type into the REPL before they know its /commands."""

from __future__ import annotations

from robosandbox.apps.repl.shell import Shell
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.session import open_session
from robosandbox.workcell.workcell import Workcell


def test_a_command_may_be_said_without_its_slash() -> None:
    with open_session(dialogue=True) as session:
        shell = Shell(WorkcellHost(session))
        assert shell.execute("again").text == "/again: nothing was said yet; say what to do first"
        assert shell.execute("Undo.").text == "nothing to undo"
        assert shell.execute("stop").text == "nothing runs; Ctrl-C stops what does"
        before = left_of_red(session)
        shell.execute("push the red cube 3 cm to the left")
        assert shell.execute("again").text.startswith("done: push(object=red_cube")
        assert 0.05 < left_of_red(session) - before < 0.07
        assert shell.execute("undo that").text == "undone: push the red cube 3 cm to the left"
        assert 0.02 < left_of_red(session) - before < 0.04
        assert shell.execute("/exit").leave and shell.execute("bye").leave


def left_of_red(session: Workcell) -> float:
    red = session.observe().find("red_cube")
    assert red is not None
    return red.pose.xyz[1]
