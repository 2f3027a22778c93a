"""Only the sim speaks in its name: forgeries by every role, on every key, through every shipped configuration."""

import importlib.util
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
import zenoh
from support.kits import KITS, OPEN, Kit, running_kit

from robosandbox.errors import ServiceUnavailableError
from robosandbox.workcell.zenoh.client import RemoteRobot, connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell
from robosandbox.workcell.zenoh.messages import Objects, State, decode
from robosandbox.workcell.zenoh.transport import open_connector

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples" / "zenoh"
HOME = ("--task", "home", "--pace", "fast")
MODES = ("peer", "client", "router")


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    path = ROOT / "benchmarks" / "forging.py"
    spec = importlib.util.spec_from_file_location("forging_bench", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module", params=KITS)
def kit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kit]:
    with running_kit(request.param, EXAMPLES, tmp_path_factory.mktemp("kit"), options=HOME) as made:
        yield made


@pytest.fixture(scope="module")
def open_kit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kit]:
    with running_kit(OPEN, EXAMPLES, tmp_path_factory.mktemp("open"), options=HOME) as made:
        yield made


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.sample(every=5)
def test_no_role_can_forge_on_any_key(kit: Kit, mode: str, bench: ModuleType) -> None:
    for role in kit.roles:
        rows = list(bench.attack(kit, role, mode, times=1))
        assert {row.key for row in rows} == set(bench.protocol_keys()) and {row.kind for row in rows} == set(
            bench.FORGERIES
        )
        assert not [row for row in rows if row.forged]


def test_every_forgery_works_where_nothing_stops_it(open_kit: Kit, bench: ModuleType) -> None:
    stopped = {(row.kind, row.key) for row in bench.attack(open_kit, "anyone", "client", times=1) if not row.forged}
    # The sim's own token is there as long as one of the two is.
    assert stopped == {("departure", "alive")}


# What an operator does while somebody forges.


@contextmanager
def forged_scenes(forging: zenoh.Session, robot: RemoteRobot) -> Iterator[None]:
    """Answer and publish, as the sim would, a scene in which left is right."""
    seen = robot.look()
    places = [item.pose for item in seen.scene.objects]
    swapped = tuple(replace(item, pose=pose) for item, pose in zip(seen.scene.objects, reversed(places), strict=True))
    payload = seen.model_copy(update={"scene": replace(seen.scene, objects=swapped)}).encode()
    key = f"robosandbox/{robot.id}/obs/objects"

    def reply(query: zenoh.Query) -> None:
        with query:
            query.reply(key, payload, encoding="application/json")

    with forging.declare_queryable(key, reply, complete=True), forging.declare_queryable("robosandbox/**", reply):
        forging.put(key, payload)
        yield


def leftmost(robot: RemoteRobot) -> str:
    return max(robot.truth().objects.values(), key=lambda item: item.pose.xyz[1]).id


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.sample(every=5)
def test_left_cube_is_lifted_while_a_forger_says_that_it_is_right(kit: Kit, mode: str, bench: ModuleType) -> None:
    forging_role, operator = kit.roles[-1], kit.roles[0]
    with connect(*kit.endpoints, zenoh_config=kit.config(operator), timeout=30) as client:
        robot = client.robot()
        robot.load("pick_from_three")
        left = leftmost(robot)
        with bench.forger(kit, forging_role, mode) as forging, forged_scenes(forging, robot):
            bench.settle(forging)
            episode = RemoteWorkcell(robot).run("pick up the left cube")
        assert episode.success and robot.truth().held == left


def test_client_believes_the_session_that_it_met_as_the_sim(
    open_kit: Kit, bench: ModuleType, caplog: pytest.LogCaptureFixture
) -> None:
    """Nothing but the client stops a forger here."""
    with connect(*open_kit.endpoints, timeout=30) as client:
        robot = client.robot()
        robot.load("pick_from_three")
        left = leftmost(robot)
        objects = robot.look().scene.objects
        heard: list[Objects] = []
        watch = robot.watch("obs/objects", lambda sample: heard.append(decode(sample.payload.to_bytes(), Objects)))
        with bench.forger(open_kit, "anyone", "client") as forging, forged_scenes(forging, robot):
            bench.settle(forging)
            assert all(robot.look().scene.objects == objects for _ in range(20))
            assert RemoteWorkcell(robot).run("pick up the left cube").success and robot.truth().held == left
        watch.undeclare()
        # The forged scene has it on the right.
        assert all(item.pose.xyz[1] > 0.0 for seen in heard for item in seen.scene.objects if item.id == left)
    assert "is not believed" in caplog.text


def test_restarted_sim_is_believed_by_whoever_only_listens(open_kit: Kit) -> None:
    with connect(*open_kit.endpoints, timeout=30) as client:
        robot = client.robot()
        before = robot.state().boot_id
        again = threading.Event()

        def hear(sample: zenoh.Sample) -> None:
            if decode(sample.payload.to_bytes(), State).boot_id != before:
                again.set()

        watch = robot.watch("obs/state", hear)
        open_kit.sim.kill()
        open_kit.sim.restart()
        assert again.wait(30)
        watch.undeclare()


# Last of those at the open router: after it the router waits 10 s for the forger's answer to whoever asks next.
def test_client_believes_nobody_where_two_answer_from_the_start(open_kit: Kit, bench: ModuleType) -> None:
    with bench.forger(open_kit, "anyone", "client") as forging:

        def reply(query: zenoh.Query) -> None:
            with query:
                query.reply(str(query.key_expr), b"{}")

        with forging.declare_queryable("robosandbox/robot/info", reply):
            bench.settle(forging)
            with connect(*open_kit.endpoints, timeout=30) as client, pytest.raises(ServiceUnavailableError) as caught:
                client.robot()
    assert "2 Zenoh sessions answer for robot 'robot'" in str(caught.value)


def test_token_of_a_client_is_its_own(kit: Kit, bench: ModuleType) -> None:
    """Even who is told another client's id cannot have its goals cancelled."""
    with connect(*kit.endpoints, zenoh_config=kit.config(kit.roles[0]), timeout=30) as client:
        robot = client.robot()
        robot.load("pick_from_three")
        for role in kit.roles:
            robot.reset(0)
            with bench.forger(kit, role, "client") as forging:
                robot.set_pace("realtime")
                goal = robot.send("pick", {"object": "red_cube"})
                for _ in range(5):
                    token = forging.liveliness().declare_token(f"robosandbox/{robot.id}/client/{client.id}")
                    bench.settle(forging)
                    token.undeclare()
                    bench.settle(forging)
                robot.set_pace("fast")
                assert goal.wait(60).skill == "pick", role


def test_sim_at_a_router_cannot_act_on_another(kit: Kit, bench: ModuleType) -> None:
    if kit.name != "router":
        pytest.skip("sims meet at a router only")
    with open_connector(config_file=kit.config("sim"), timeout=30) as other:
        bench.meet(other)
        asked = (
            "skill/home/send_goal",
            "skill/home/cancel_goal",
            "reset",
            "load",
            "clock",
            "checkpoint",
            "skill/run/send_goal",
            "truth",
        )
        for suffix in asked:
            assert not list(other.get(f"robosandbox/robot/{suffix}", payload=b"?", timeout=10)), suffix
