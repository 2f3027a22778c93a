"""The protocol's page says what the models and a sim process do."""

import importlib.util
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import zenoh
from support.processes import SimProcess

from robosandbox.errors import Failure
from robosandbox.types import ArmState, Grasp, GraspSearch, GripperState, Observation, Pose, Trajectory, frozen_array
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.messages import Feedback, Goal, GoalIntent, SendGoal, State, decode

DOCS = Path(__file__).resolve().parents[1] / "docs"


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_protocol", DOCS / "make_protocol.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_values_come_back_from_the_wire_as_they_were() -> None:
    pose = Pose(xyz=(0.1, 0.0, 0.2))
    grasp = Grasp(object="mug", tcp_pose=pose, width=0.03, quality=0.5, how="rim")
    goal_id = "2b2a598c-17ec-499e-9e06-4558f2c5bc3f"
    told = decode(GoalIntent(goal_id=goal_id, intent=GraspSearch(candidates=(grasp,), chosen=0)).encode(), GoalIntent)
    assert told.intent == GraspSearch(candidates=(grasp,), chosen=0)
    path = Trajectory(q=frozen_array([[0.0, 0.5], [0.25, 0.75]]), dt=0.1)
    back = decode(GoalIntent(goal_id=goal_id, intent=path).encode(), GoalIntent).intent
    assert isinstance(back, Trajectory) and back.dt == path.dt and not back.q.flags.writeable
    np.testing.assert_array_equal(back.q, path.q)
    gripper = GripperState(joint=0.01, width=0.02, closed=0.5, force=None, commanded=0.4)
    arm = ArmState(time=1.0, q=path.q[0], qd=path.q[1], tcp_pose=pose, gripper=gripper)
    seen = Observation(time=1.0, arms={"arm": arm})
    state = State(boot_id="b", seq=0, stamp=0.0, robot=seen, hands={"hand": None}, physics_steps=3)
    robot = decode(state.encode(), State).robot
    assert robot.gripper == gripper and robot.tcp_pose == pose and robot.q.tolist() == [0.0, 0.5]


def test_the_page_is_what_the_generator_writes(generator: ModuleType) -> None:
    assert (DOCS / "protocol.md").read_text() == generator.page(), "run docs/make_protocol.py"


def test_links_in_the_page_lead_to_a_heading() -> None:
    text = (DOCS / "protocol.md").read_text()
    headings = {line.lstrip("# ").lower() for line in text.splitlines() if line.startswith("##")}
    assert set(re.findall(r"\]\(#([^)]+)\)", text)) <= headings
    for file in re.findall(r"\]\((\.\./[^)#]+)\)", text):
        assert (DOCS / file).is_file(), file


def test_schemas_in_the_page_are_json() -> None:
    blocks = re.findall(r"```json\n(\{\n.*?)```", (DOCS / "protocol.md").read_text(), flags=re.DOTALL)
    assert len(blocks) > 20
    for block in blocks:
        assert json.loads(block)["type"] in ("object", "string")


def test_the_worked_example_is_of_the_protocol() -> None:
    example = (DOCS / "protocol.in.md").read_text().partition("## An example")[2]
    sent, accepted, feedback, succeeded, failed, refusal = re.findall(r"```json\n(.*?)\n```", example)
    goal_id = decode(sent.encode(), SendGoal).goal_id
    assert [decode(item.encode(), Goal).status for item in (accepted, succeeded, failed)] == [
        "accepted",
        "succeeded",
        "failed",
    ]
    assert decode(succeeded.encode(), Goal).goal_id == decode(feedback.encode(), Feedback).goal_id == goal_id
    assert Failure.model_validate_json(refusal).code == "invalid_message"


@pytest.fixture(scope="module")
def session() -> Iterator[zenoh.Session]:
    with SimProcess("--task", "home", "--pace", "fast") as sim, connect(sim.endpoint, timeout=30) as client:
        yield client.session


def test_every_query_in_the_table_is_answered_by_a_sim(generator: ModuleType, session: zenoh.Session) -> None:
    for key, kind, *_ in generator.KEYS:
        if "query" not in kind:
            continue
        camera = "/camera/" in key
        key = "robosandbox/robot/" + key.replace("<name>", "home")
        replies = list(session.get(key, payload=b"{", timeout=20.0))
        assert len(replies) == 1 and replies[0].err is not None, key
        error = Failure.model_validate_json(replies[0].err.payload.to_bytes())
        assert error.code == "invalid_message", key
        assert ("no camera 'home'" if camera else "no JSON") in error.message


def test_every_queryable_of_a_sim_is_in_the_table(generator: ModuleType) -> None:
    server = (DOCS.parent / "src" / "robosandbox" / "workcell" / "zenoh" / "server" / "server.py").read_text()
    declared = set(
        re.findall(
            r'^            "([a-z_/*]+)": (?:self\.(?:_on_|_goals\.|_reading\()|lambda request: )',
            server,
            flags=re.MULTILINE,
        )
    )
    assert len(declared) > 10
    listed = {key.replace("<name>", "*") for key, kind, *_ in generator.KEYS if "query" in kind and "camera" not in key}
    assert declared == listed
