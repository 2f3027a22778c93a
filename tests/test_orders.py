"""Orders over Zenoh, as a client without this package sends them: JSON objects and keys alone."""

import json
import time
import uuid
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh
from support.processes import SimProcess

from robosandbox.skills.manual import MANUAL
from robosandbox.workcell.orders import ORDERS
from robosandbox.workcell.zenoh.client import Client, connect

# Seconds within which a goal ends; chosen to tell a hang.
_SECONDS = 60.0


class JsonClient:
    """A client that knows keys and JSON."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

    def ask(self, suffix: str, message: dict[str, Any] | None = None) -> dict[str, Any]:
        payload = None if message is None else json.dumps(message).encode()
        (reply,) = self._session.get(f"robosandbox/robot/{suffix}", payload=payload, timeout=10.0)
        answer: dict[str, Any] = json.loads((reply.ok or reply.err).payload.to_bytes())  # type: ignore[union-attr]
        return answer

    def order(self, name: str, **arguments: Any) -> dict[str, Any]:
        """Send a goal and return it as it ends."""
        goal_id = str(uuid.uuid4())
        accepted = self.ask(f"skill/{name}/send_goal", {"goal_id": goal_id, "arguments": arguments})
        end = time.monotonic() + _SECONDS
        goal = accepted
        while goal.get("status") in ("accepted", "executing") and time.monotonic() < end:
            goal = self.ask(f"skill/{name}/get_result", {"goal_id": goal_id})
        return goal


@pytest.fixture(scope="module")
def sim() -> Iterator[SimProcess]:
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as process:
        yield process


@pytest.fixture(scope="module")
def connected(sim: SimProcess) -> Iterator[Client]:
    with connect(sim.endpoint) as client:
        client.robot()
        yield client


@pytest.fixture
def client(connected: Client) -> JsonClient:
    connected.robot().reset(0)
    return JsonClient(connected.session)


STEPS = [{"skill": "pick", "arguments": {"object": "red_cube"}}]


def test_a_sentence_is_carried_out_and_its_end_tells_what_was_done(client: JsonClient) -> None:
    goal = client.order("run", prompt="put the red cube on the blue cube")
    assert goal["status"] == "succeeded" and goal["answer"]["success"]
    assert [step["call"] for step in goal["answer"]["done"]] == ["pick(object=red_cube)", "place_on(target=blue_cube)"]
    assert client.order("run", prompt="where is the red cube?")["answer"]["answer"].startswith(
        "red_cube is on blue_cube"
    )


def test_a_question_of_the_robot_is_answered_by_the_next_sentence(client: JsonClient) -> None:
    asked = client.order("run", prompt="pick up the cube")
    assert asked["status"] == "failed" and asked["error"]["code"] == "refused"
    assert asked["answer"]["refusal"]["candidates"] == ["red_cube", "green_cube", "blue_cube"]
    assert client.order("run", prompt="the left one")["answer"]["done"][0]["call"] == "pick(object=blue_cube)"


def test_plans_are_made_checked_and_tried(client: JsonClient) -> None:
    plan = client.order("plan", prompt="pick up the red cube")["answer"]["plan"]
    assert plan == STEPS and client.order("check", steps=plan)["answer"]["ok"]
    assert client.order("simulate", steps=plan)["answer"]["would_work"] == ["pick(object=red_cube)"]
    assert client.ask("obs/state")["hands"] == {"hand": None}
    assert client.order("follow", steps=plan)["status"] == "succeeded" and client.ask("obs/state")["hands"] == {
        "hand": "red_cube"
    }


def test_goals_are_reached_and_the_task_is_judged(client: JsonClient) -> None:
    assert not client.order("judge")["answer"]["success"]
    assert client.order("achieve", goals=["holding(green_cube)"])["status"] == "succeeded"
    assert client.order("judge")["answer"]["success"]


def test_the_hand_moves_by_itself(client: JsonClient) -> None:
    moves = {skill["name"] for skill in client.ask("info")["skills"] if skill["by_hand"]}
    assert moves == {item.name for item in MANUAL}
    assert client.order("move_to", x=0.2, y=0.1, z=0.3)["status"] == "succeeded"


def test_a_failure_is_a_failed_goal_with_its_first_cause(client: JsonClient) -> None:
    goal = client.order("follow", steps=[{"skill": "move_to", "arguments": {"x": 2.0, "y": 0.0, "z": 0.3}}])
    assert goal["status"] == "failed" and goal["error"]["code"] == "unreachable" and goal["answer"]["done"] == []
    assert client.order("achieve", goals=["on(red_cube, moon)"])["status"] == "failed"


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("run", {"sentence": "go home"}, "run: prompt"),
        ("check", {"steps": [{"skill": 7}]}, "check: steps"),
        ("achieve", {"goals": ["beyond(red_cube)"]}, "no relation is called 'beyond'"),
        ("juggle", {}, "no skill 'juggle'"),
    ],
)
def test_a_wrong_order_is_refused_by_the_field(
    client: JsonClient, name: str, arguments: dict[str, Any], said: str
) -> None:
    goal = client.order(name, **arguments)
    assert said in goal.get("message", "") or said in goal["error"]["message"], goal


def test_no_skill_has_the_name_of_an_order(connected: Client) -> None:
    assert not ORDERS.keys() & connected.robot().calls.keys()


def test_a_sentence_is_cancelled_while_it_moves(client: JsonClient, connected: Client) -> None:
    robot = connected.robot()
    robot.set_pace("realtime")
    goal = robot.send("run", {"prompt": "put the red cube on the blue cube"})
    next(goal.follow())
    robot.cancel(goal)
    assert client.ask("skill/run/get_result", {"goal_id": goal.id})["skill"] == "run"
    for _ in goal.follow():
        pass
    robot.set_pace("fast")
    assert goal.goal.status == "cancelled"
