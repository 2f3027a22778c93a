"""Worlds that are closed or tried out are freed at once, not when Python next looks for cycles."""

import gc
import threading
import weakref
from collections.abc import Iterator
from typing import Any

import pytest

from robosandbox.agent.context import AgentContext
from robosandbox.agent.preview import preview
from robosandbox.agent.tools import simulated
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.world import World
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.session import open_session
from robosandbox.workcell.studio import Studio


def pick(object_id: str) -> Plan:
    return Plan(steps=(SkillCall(skill="pick", arguments={"object": object_id}),))


@pytest.fixture(autouse=True)
def no_collector() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.fixture
def worlds(monkeypatch: pytest.MonkeyPatch) -> "weakref.WeakSet[MuJoCoBackend]":
    """Every simulated world that is made and not freed yet."""
    found: weakref.WeakSet[MuJoCoBackend] = weakref.WeakSet()
    make = MuJoCoBackend.__init__

    def noted(self: MuJoCoBackend, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        found.add(self)

    monkeypatch.setattr(MuJoCoBackend, "__init__", noted)
    return found


@pytest.mark.parametrize("object_id", ["red_cube", "elephant"])
def test_a_twin_is_freed_when_its_trial_has_ended(object_id: str, worlds: "weakref.WeakSet[MuJoCoBackend]") -> None:
    with open_session("pick_from_three") as session:
        for _ in range(3):
            preview(session.ctx, pick(object_id), session.agent.skills)
            simulated(session.ctx, pick(object_id), session.agent.skills)
        # The motion planner keeps the scene that it planned in last.
        assert len(worlds) <= 2


def test_the_twins_of_repairs_are_freed(worlds: "weakref.WeakSet[MuJoCoBackend]") -> None:
    with open_session("pick_from_three") as session:
        session.agent.run("pick up the red cube")
        for _ in range(3):
            failed = session.agent.follow(pick("blue_cube")).error
            assert failed is not None
            assert failed.repairs
        assert len(worlds) <= 2


def test_a_workcell_that_was_closed_is_freed_with_its_world() -> None:
    session = open_session("pick_from_three")
    session.run()
    session.driver.subscribe(lambda: None)
    cell, sim = weakref.ref(session), weakref.ref(session.driver)
    session.close()
    del session
    assert cell() is None
    assert sim() is None


def test_pictures_of_a_world_that_was_exchanged_are_freed_though_none_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    closed = threading.Event()
    with open_session("home") as before, open_session("home") as after:
        studio = Studio(before.driver, lambda job: job(), "boot")
        monkeypatch.setattr(studio._photographer, "close", closed.set)
        studio.start()
        with studio.lock:
            studio.exchange(after.driver)
        assert closed.wait(20.0)
        studio.stop()


def test_opening_judging_and_closing_leave_no_world_and_no_large_table_to_the_collector() -> None:
    def once() -> None:
        with open_session("pick_from_three") as session:
            session.judge()
            session.reset(1)

    # What is looked up once stays.
    once()
    gc.collect()
    once()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        gc.collect()
        left = list(gc.garbage)
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
    assert not [item for item in left if isinstance(item, MuJoCoBackend | World | AgentContext)]
    # Python's own look at some signatures copies the table of modules.
    assert not [item for item in left if isinstance(item, dict) and "sys" in item]
