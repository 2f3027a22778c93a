"""The sim process and its clients: real processes on loopback."""

import json
import logging
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support.forked import told_in_forked_child
from support.processes import SimProcess, free_port

from robosandbox.agent.agent import Agent
from robosandbox.agent.planner import StubPlanner
from robosandbox.apps.bench.bench import run_bench
from robosandbox.errors import (
    BusyError,
    ConnectionLostError,
    ForbiddenError,
    InputError,
    InternalError,
    InvalidArgumentError,
    InvalidMessageError,
    NotHoldingError,
    ServiceUnavailableError,
    UnknownGoalError,
    UnreachableError,
    UnsupportedError,
)
from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.tasks.loader import find_task
from robosandbox.types import SkillResult
from robosandbox.workcell.zenoh.client import Client, RemoteRobot, connect
from robosandbox.workcell.zenoh.client.goal import RemoteGoal
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell
from robosandbox.workcell.zenoh.messages import Goal, GoalStatus, Message
from robosandbox.workcell.zenoh.server.checkpoint import SavedWorld, StateFile
from robosandbox.workcell.zenoh.server.loader import TaskLoader
from robosandbox.workcell.zenoh.server.publishing import _Stream
from robosandbox.workcell.zenoh.server.server import SimServer
from robosandbox.workcell.zenoh.transport import open_listener

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def sim() -> Iterator[SimProcess]:
    with SimProcess("--pace", "fast") as process:
        yield process


@pytest.fixture
def client(sim: SimProcess) -> Iterator[Client]:
    with connect(sim.endpoint) as client:
        yield client


@pytest.fixture
def robot(client: Client) -> RemoteRobot:
    robot = client.robot()
    robot.load("pick_from_three")
    return robot


def cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from robosandbox.apps.cli import main; main()", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


def report(script: str, *options: str) -> dict[str, Any]:
    """Run a benchmark and return what it printed."""
    command = [sys.executable, str(ROOT / "benchmarks" / script), *options, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    table: dict[str, Any] = json.loads(done.stdout)
    return table


# Working.


def test_remote_bench_gives_the_rows_of_an_embedded_one(robot: RemoteRobot) -> None:
    tasks = [find_task(name) for name in ("pick_ball", "push_left")]
    robot.set_pace("fast")
    rows = {}
    for name, remote in (("embedded", None), ("remote", RemoteWorkcell(robot))):
        # Contacts are watched in worlds of our own only.
        apart = {"secs": 0.0, "touched": (), "worst_force_n": None, "worst_intended_force_n": None}
        rows[name] = [{**row.record(), **apart} for row in run_bench(tasks, 2, remote=remote)]
    assert rows["remote"] == rows["embedded"]
    assert all(row["success"] for row in rows["remote"])


def test_same_agent_class_drives_a_remote_robot(robot: RemoteRobot) -> None:
    phases: list[str] = []
    agent = Agent(ctx=robot.ctx, skills=robot.skills, planner=StubPlanner(robot.skills))
    agent.ctx.events.subscribe(lambda event: phases.append(getattr(event, "phase", "")))
    assert agent.run("put the red cube to the left of the blue cube").success
    assert {"approach", "grasp", "lift", "release"} <= set(phases)


def test_agent_command_prints_what_run_prints(sim: SimProcess, robot: RemoteRobot) -> None:
    robot.load("pick_cube_franka")
    remote = cli("agent", "--connect", sim.endpoint)
    embedded = cli("run", "--task", "pick_cube_franka")
    assert (remote.returncode, remote.stdout) == (embedded.returncode, embedded.stdout) == (0, embedded.stdout)
    assert embedded.stdout.startswith("done: pick(object=red_cube)")


def test_remote_errors_are_the_local_classes_with_evidence(robot: RemoteRobot) -> None:
    with pytest.raises(NotHoldingError) as empty:
        robot.send("place_on", {"target": "blue_cube"}).wait()
    assert empty.value.evidence is not None
    robot.send("pick", {"object": "red_cube"}).wait()
    with pytest.raises(UnreachableError) as far:
        robot.send("place_at", {"x": 0.46, "y": 0.46}).wait()
    assert far.value.evidence is not None and far.value.evidence.position_error > 0.01  # type: ignore[union-attr]
    with pytest.raises(InvalidArgumentError, match="did you mean 'pick'"):
        robot.send("pik", {"object": "red_cube"})
    with pytest.raises(InvalidArgumentError, match="object"):
        robot.send("pick", {"object": 7})


def test_checkpoint_brings_the_world_back(robot: RemoteRobot) -> None:
    before = robot.truth()
    name = robot.checkpoint()
    robot.send("pick", {"object": "red_cube"}).wait()
    assert robot.truth().held == "red_cube"
    back = robot.reset(checkpoint=name)
    assert back.held is None
    assert [item.pose for item in back.objects.values()] == [item.pose for item in before.objects.values()]
    with pytest.raises(InputError, match="checkpoint"):
        robot.reset(checkpoint="nothing")


def test_clients_load_bundled_tasks_and_no_files_of_the_sim(robot: RemoteRobot, tmp_path: Path) -> None:
    robot.load("stack_two")
    assert {item.id for item in robot.observe().objects} == {"red_cube", "blue_cube"}
    document = find_task("stack_two").model_dump(mode="json")
    document["scene"]["robot_urdf"] = str(tmp_path / "arm.urdf")
    with pytest.raises(InputError, match="--allow-files"):
        robot.load(document=document)
    with pytest.raises(InputError, match="--allow-files"):
        robot.load("stack_two", robot="../../etc/passwd")
    with pytest.raises(InputError, match="stack_two"):
        robot.load("stack_to")


def test_pace_that_a_client_sets_ends_with_it(sim: SimProcess, robot: RemoteRobot) -> None:
    with connect(sim.endpoint) as other:
        other.robot().set_pace("realtime")
        assert robot.info().pace == "realtime"
        other.robot().set_pace("realtime")
    # The sim hears of the end at about the time that we do.
    for _ in range(500):
        if robot.info().pace == "fast":
            return
    raise AssertionError("the pace outlived its client")


def test_truth_can_be_switched_off() -> None:
    with SimProcess("--task", "home", "--no-ground-truth") as sim, connect(sim.endpoint) as client:
        with pytest.raises(ForbiddenError, match="--no-ground-truth"):
            client.robot().truth()
        session = RemoteWorkcell(client.robot())
        assert session.run("go home").success and not session.judgeable
        with pytest.raises(UnsupportedError, match="no-ground-truth"):
            session.judge()
        assert client.robot().reset(1).objects == {}


def test_no_sim_is_said_in_one_line_with_exit_code_3() -> None:
    done = cli("agent", "go home", "--connect", f"tcp/127.0.0.1:{free_port()}")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1 and "robo-sandbox sim" in done.stderr
    with pytest.raises(ServiceUnavailableError):
        connect(f"tcp/127.0.0.1:{free_port()}", timeout=0.1)


def test_port_and_robot_id_are_taken_once(sim: SimProcess) -> None:
    done = cli("sim", "--listen", sim.endpoint)
    assert done.returncode == 3 and "cannot listen" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--robot-id", "Arm 1"), "--robot-id"),
        (("--robot-id", "**"), "--robot-id"),
        (("--pace", "quick"), "--pace"),
        (("--seed", "-1"), "--seed"),
        (("--listen", "nonsense"), "--listen"),
        (("--task", "pick_cube_frnka"), "pick_cube_franka"),
        (("--state-file", "/no/such/folder/file"), "--state-file"),
        (("--zenoh-config", "/no/such/file"), "--zenoh-config"),
        (("--allow-files", "/no/such/folder"), "--allow-files"),
        (("--perception", "grund_truth"), "ground_truth"),
    ],
)
@pytest.mark.sample(every=5)
def test_wrong_options_of_sim_are_one_line(options: tuple[str, ...], said: str) -> None:
    # The usual port may be in use on this machine.
    listen = () if "--listen" in options else ("--listen", "tcp/127.0.0.1:0")
    done = cli("sim", *listen, *options)
    assert done.returncode == 2
    assert said in done.stderr and done.stderr.count("\n") == 1


def test_sim_stops_cleanly_on_signals() -> None:
    for number in (2, 15):
        with SimProcess("--task", "home") as sim, connect(sim.endpoint) as client:
            client.robot().send("home")
            assert sim.stop(number) == 0


@pytest.mark.slow
def test_state_file_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "state"
    for content in ("", "{}", '{"version": 9}', "\xff\xfe"):
        file.write_text(content, encoding="latin-1")
        done = cli("sim", "--state-file", str(file))
        assert done.returncode == 2 and "state" in done.stderr and done.stderr.count("\n") == 1


def test_fault_of_a_skill_becomes_an_internal_error_with_an_id_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    class Broken(Skill):
        name = "broken"

        def run(self, ctx: SkillContext) -> SkillResult:
            """Fail."""
            raise KeyError("a fault on purpose")

    loader = TaskLoader()
    host = loader.open("home")
    host.agent.skills["broken"] = Broken()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session, _ = open_listener(endpoint)
    server = SimServer(host, session, robot_id="arm-1", load=loader.load, pace="fast")
    with session, server, connect(endpoint) as client, caplog.at_level(logging.ERROR):
        robot = client.robot("arm-1")
        with pytest.raises(InternalError) as raised:
            robot.send("broken").wait()
        fault_id = raised.value.message.split()[-1]
        assert fault_id in caplog.text and "a fault on purpose" in caplog.text
        assert "a fault on purpose" not in raised.value.message
        assert robot.send("home").wait().skill == "home"


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_client_in_a_forked_process_says_that_it_was_forked(sim: SimProcess, client: Client) -> None:
    robot = client.robot()
    goal = robot.send("home")
    goal.wait()
    running = RemoteGoal(robot, Goal(goal_id=goal.id, boot_id="", skill="home", status=GoalStatus.ACCEPTED))
    for work in (robot.state, robot.observe, running.wait, running.cancel, lambda: connect(sim.endpoint)):
        told = told_in_forked_child(work)
        assert told.startswith("ServiceUnavailableError: Zenoh was used in process") and "'spawn'" in told
    assert told_in_forked_child(client.close) == ""
    assert robot.state().boot_id, "the parent goes on"


def test_after_a_cancel_send_says_that_the_goal_is_being_stopped_and_how_to_wait() -> None:
    stopped = threading.Event()

    class Slow(Skill):
        name = "slow"

        def run(self, ctx: SkillContext) -> SkillResult:
            """End when it is let."""
            stopped.wait(60.0)
            return SkillResult(skill="slow")

    loader = TaskLoader()
    host = loader.open("home")
    host.agent.skills["slow"] = Slow()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session, _ = open_listener(endpoint)
    with session, SimServer(host, session, robot_id="arm-1", load=loader.load), connect(endpoint) as client:
        robot = client.robot("arm-1")
        goal = robot.send("slow")
        with pytest.raises(BusyError, match="busy with slow; cancel it, wait for it, or send with queue"):
            robot.send("home")
        goal.cancel()
        with pytest.raises(BusyError, match=r"slow; it was cancelled and is being stopped; wait for its end \(`wait`"):
            robot.send("home")
        with pytest.raises(BusyError, match="slow; it is being stopped; wait for its end"):
            robot.reset(0)
        queued = robot.send("home", queue=True)
        stopped.set()
        assert queued.wait().skill == "home"


def test_nan_from_python_is_refused_as_such(robot: RemoteRobot) -> None:
    for value in (float("nan"), float("inf")):
        with pytest.raises(InvalidMessageError):
            robot.send("place_at", {"x": value, "y": 0.0})


def test_goal_of_a_lost_client_has_failed_and_not_been_cancelled(sim: SimProcess, robot: RemoteRobot) -> None:
    robot.set_pace("realtime")
    with connect(sim.endpoint) as other:
        goal = other.robot().send("pick", {"object": "red_cube"})
    with pytest.raises(ConnectionLostError) as lost:
        while True:
            found = robot.result("pick", goal.id)
            if found.status.final:
                found.outcome()
    assert lost.value.evidence is not None and lost.value.evidence.restarted is False  # type: ignore[union-attr]
    robot.set_pace("fast")


def test_request_of_a_client_is_small_and_a_task_may_be_larger(robot: RemoteRobot) -> None:
    with pytest.raises(InvalidMessageError, match="64,000"):
        robot.send("pick", {"object": "x" * 70_000})
    with pytest.raises(InputError) as refused:
        robot.load(document={"name": "x" * 70_000})
    assert "bytes" not in str(refused.value)


def test_goal_is_saved_as_ended_before_anybody_hears_so(tmp_path: Path) -> None:
    file = StateFile(tmp_path / "world.json")
    loader = TaskLoader()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session, _ = open_listener(endpoint)
    server = SimServer(loader.open("home"), session, robot_id="robot", load=loader.load, pace="fast", state_file=file)
    told: list[tuple[str, str]] = []
    save = file.save

    def late_save(world: SavedWorld) -> None:
        known = [robot.result("home", item.goal.goal_id).status for item in world.goals]
        told.extend((status, item.goal.status) for status, item in zip(known, world.goals, strict=True))
        save(world)

    with session, server, connect(endpoint) as client:
        robot = client.robot()
        file.save = late_save  # type: ignore[method-assign]
        robot.send("home").wait()
        file.save = save  # type: ignore[method-assign]
    assert ("executing", "succeeded") in told


def test_result_of_an_unknown_goal_is_an_error(robot: RemoteRobot) -> None:
    with pytest.raises(UnknownGoalError):
        robot.result("pick", "00000000-0000-4000-8000-000000000000")


def test_reset_while_a_goal_runs_is_refused_as_busy(sim: SimProcess, robot: RemoteRobot) -> None:
    robot.set_pace("realtime")
    goal = robot.send("pick", {"object": "red_cube"})
    with pytest.raises(BusyError) as busy:
        robot.reset(0)
    assert busy.value.evidence is not None and busy.value.evidence.goal_id == goal.id  # type: ignore[union-attr]
    goal.cancel()
    robot.set_pace("fast")


@pytest.mark.gl
def test_pictures_come_with_intrinsics_and_pose(robot: RemoteRobot) -> None:
    payload, about = robot.picture("scene")
    assert payload[:2] == b"\xff\xd8" and (about.intrinsics.width, about.intrinsics.height) == (640, 480)
    # Pixels' centres are at whole numbers, as in what perception gets: the middle lies between two of them.
    assert (about.intrinsics.cx, about.intrinsics.cy) == (319.5, 239.5)
    raw, about = robot.picture("top", depth=True)
    assert len(raw) == 4 * about.intrinsics.width * about.intrinsics.height
    with pytest.raises(InvalidMessageError, match="scene"):
        robot.picture("scne")
    with pytest.raises(InvalidMessageError, match="format"):
        robot.picture("scene", format="bmp")


# Faults: the benchmarks that count them, once or twice each.


@pytest.mark.slow
def test_killed_sim_is_waited_for_and_the_task_finished() -> None:
    row = report("faults.py", "sim_killed", "--times", "3")["sim_killed"]
    assert row["task_finished"] == 3, row
    assert row["noticed_ms_max"] < 1000.0


@pytest.mark.slow
def test_killed_agent_leaves_the_arm_holding_and_the_robot_free() -> None:
    row = report("faults.py", "agent_killed", "--times", "2")["agent_killed"]
    assert (row["arm_holds"], row["next_client_served"]) == (2, 2), row


@pytest.mark.slow
def test_cancelled_arm_is_still_within_200_ms_of_asking_its_process() -> None:
    row = report("faults.py", "cancelled", "--times", "1")["cancelled"]
    assert row["sim_s_to_still_max"] <= 0.2, row


@pytest.mark.slow
def test_small_faults_are_counted_in_full() -> None:
    names = ("numbers", "deadline", "duplicate", "busy", "late_joiner", "many_clients")
    table = report("faults.py", *names, "--times", "2")
    assert table["numbers"]["refused"] == table["numbers"]["tried"] and table["numbers"]["physics_untouched"]
    assert table["deadline"]["stopped_and_still"] == 2
    assert table["duplicate"]["ran_once"] == 2
    assert (table["busy"]["refused"], table["busy"]["queued_ran"]) == (2, 2)
    assert table["late_joiner"]["result_read"] == 2
    assert table["many_clients"]["served"] == 50 and table["many_clients"]["pick_afterwards"]


@pytest.mark.slow
def test_nonsense_gets_typed_errors_and_harms_nothing() -> None:
    row = report("garbage.py", "--payloads", "200")
    assert row["wrong_count"] == 0, row["wrong"]
    assert row["physics_untouched"] and row["pick_afterwards"]


def test_an_answer_that_comes_after_a_stream_has_ended_is_not_published() -> None:
    asked: list[Callable[[], None]] = []
    heard: list[object] = []
    there = threading.Event()

    def read(answer: Callable[[], None]) -> None:
        asked.append(answer)
        there.set()

    class Kept(_Stream):
        def _tick(self) -> None:
            self._ask()

        def _hear(self, message: object) -> None:
            heard.append(message)

        def _undeclare(self) -> None:
            heard.append("undeclared")

    stream = Kept("kept", 50.0, read, Message)
    stream.start()
    assert there.wait(10.0)
    stream.stop()
    (answer,) = asked
    answer()
    assert heard == ["undeclared"]
