"""The protocol's page says what the models and a sim process do."""

import importlib.util
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
import zenoh

from robosandbox.errors import ErrorRecord
from robosandbox.service.client import connect
from robosandbox.service.messages import Feedback, Goal, SendGoal, decode
from robosandbox.testing.processes import SimProcess

DOCS = Path(__file__).resolve().parents[1] / "docs"


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_protocol", DOCS / "make_protocol.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


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
    assert ErrorRecord.model_validate_json(refusal).code == "invalid_message"


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
        error = ErrorRecord.model_validate_json(replies[0].err.payload.to_bytes())
        assert error.code == "invalid_message", key
        assert ("no camera 'home'" if camera else "no JSON") in error.message


def test_every_queryable_of_a_sim_is_in_the_table(generator: ModuleType) -> None:
    server = (DOCS.parent / "src" / "robosandbox" / "service" / "server" / "server.py").read_text()
    declared = set(re.findall(r'^            "([a-z_/*]+)": self\.(?:_on_|_goals\.)', server, flags=re.MULTILINE))
    assert len(declared) > 10
    listed = {key.replace("<name>", "*") for key, kind, *_ in generator.KEYS if "query" in kind and "camera" not in key}
    assert declared == listed
