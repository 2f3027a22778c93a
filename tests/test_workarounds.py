"""Candidates for repairs follow from contracts, evidence and what skills declare; no skill is known by its name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from robosandbox.apps.conformance.conformance import check_alternatives
from robosandbox.errors import CollisionError, GraspError, Phase, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence, GraspEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.push import PushError, PushEvidence
from robosandbox.types import DetectedObject, ObservedScene, Pose, SkillCall, SkillResult
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import lies_in
from robosandbox.world.workarounds import cheapest

SKILLS = {skill.name: skill for skill in load_skills()}
GREY = (0.5, 0.5, 0.5, 1.0)


def box(
    name: str, x: float, y: float, *, z: float = 0.06, size: tuple[float, ...] = (0.02, 0.02, 0.02)
) -> DetectedObject:
    return DetectedObject(id=name, kind="box", size=size, colour="grey", rgba=GREY, pose=Pose(xyz=(x, y, z)))


def scene(*items: DetectedObject, held: str | None = None) -> ObservedScene:
    return ObservedScene(time=0.0, table_height=0.04, base_xy=(-0.3, 0.0), objects=items, hands={"hand": held})


def failed(call: SkillCall, error: SkillError, before: ObservedScene, now: ObservedScene | None = None) -> FailedCall:
    contract = SKILLS[call.skill].contract(**call.arguments)
    return FailedCall(
        call=call, error=error.failure, contract=contract.resolved(before), before=before, scene=now or before
    )


def found(failed: FailedCall) -> list[list[str]]:
    return [[str(call) for call in calls] for calls, _ in cheapest(failed, SKILLS)]


def in_the_way(body: str, other: str, phase: str = Phase.PLAN) -> CollisionError:
    evidence = CollisionEvidence(body=body, other=other, depth=0.01, waypoint=0, waypoints=1)
    return CollisionError("in the way", phase=phase, evidence=evidence)


LOADED = scene(box("cube", 0.1, 0.0), box("lid", 0.1, 0.0, z=0.09, size=(0.04, 0.03, 0.01)))


@pytest.mark.parametrize("skill", ["pick", "tap"])
def test_what_stands_on_the_thing_is_put_aside_or_pushed_off(skill: str) -> None:
    call = SkillCall(skill=skill, arguments={"object": "cube"})
    ways = found(failed(call, in_the_way("cube", "lid", Phase.CHECK), LOADED))
    assert any(way[0] == "pick(object=lid)" and way[-1] == str(call) for way in ways)
    assert any(way[0].startswith("push(object=lid, ") and way[-1] == str(call) for way in ways)


class Wipe(Skill):
    """A skill of nobody's catalogue."""

    name = "wipe"

    def contract(self, *, object: str) -> Contract:
        return Contract(needs=(fact("hand_empty"), fact("clear", object)), gives=(fact("tapped", object),))

    def alternatives(self, failed: FailedCall, *, object: str) -> Iterator[Alternative]:
        yield Alternative(why="held in place of wiped", first=(fact("holding", object),))

    def run(self, ctx: object, *, object: str) -> SkillResult:
        """Wipe an object."""
        raise NotImplementedError


def test_a_skill_of_another_package_has_repairs_by_its_contract_and_its_own_alternatives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(SKILLS, "wipe", Wipe())
    call = SkillCall(skill="wipe", arguments={"object": "cube"})
    ways = found(failed(call, in_the_way("cube", "lid", Phase.CHECK), LOADED))
    assert any(way[0] == "pick(object=lid)" and way[-1] == "wipe(object=cube)" for way in ways)
    assert any(way[-1] == "pick(object=cube)" for way in ways)


def test_what_the_hand_holds_is_put_down_and_fetched_again() -> None:
    held = scene(box("cube", 0.1, 0.0, z=0.3), box("block", 0.2, 0.1), box("lid", 0.2, 0.1, z=0.1), held="cube")
    call = SkillCall(skill="place_on", arguments={"target": "block"})
    ways = found(failed(call, in_the_way("block", "lid", Phase.CHECK), held))
    first = next(way for way in ways if "pick(object=lid)" in way)
    assert first[0].startswith("place_at(") and first[-2:] == ["pick(object=cube)", "place_on(target=block)"]


def test_of_a_push_the_rest_is_left_or_it_is_carried() -> None:
    before = scene(box("cube", 0.1, 0.0))
    now = scene(box("cube", 0.13, 0.0))
    call = SkillCall(skill="push", arguments={"object": "cube", "direction": "forward", "distance": 0.1})
    error = PushError(
        "short", phase=Phase.VERIFY, evidence=PushEvidence(object="cube", wanted=0.1, along=0.03, across=0.0)
    )
    ways = found(failed(call, error, before, now))
    assert ["push(object=cube, direction=forward, distance=0.07)"] in ways
    assert ["pick(object=cube)", "place_at(x=0.2, y=0.0)"] in ways
    assert [str(call)] not in ways


def test_what_is_out_of_reach_is_pushed_nearer() -> None:
    far = scene(box("cube", 0.45, 0.0))
    ways = found(failed(SkillCall(skill="pick", arguments={"object": "cube"}), UnreachableError("far"), far))
    assert ["push(object=cube, direction=back, distance=0.06)", "pick(object=cube)"] in ways


def test_nothing_is_pushed_out_of_a_tower_into_reach() -> None:
    tower = scene(box("low", 0.45, 0.0), box("high", 0.45, 0.0, z=0.1))
    pick = SkillCall(skill="pick", arguments={"object": "high"})
    assert not any(
        "push(object=high" in step for way in found(failed(pick, UnreachableError("far"), tower)) for step in way
    )


def test_a_base_out_of_reach_stays_where_it_is() -> None:
    far = scene(box("base", 0.45, 0.0), box("cube", 0.1, 0.0, z=0.3), held="cube")
    onto = SkillCall(skill="place_on", arguments={"target": "base"})
    assert not any(
        "push(object=base" in step for way in found(failed(onto, UnreachableError("far"), far)) for step in way
    )


def test_a_bin_out_of_reach_is_pushed_nearer_only_where_it_is_to_be_moved() -> None:
    bin_ = replace(box("bin", 0.45, 0.0, size=(0.1, 0.1, 0.05, 0.01)), kind="bin")
    far = scene(bin_, box("cube", 0.1, 0.0, z=0.3), held="cube")
    into = SkillCall(skill="place_in", arguments={"container": "bin"})
    assert not any(
        "push(object=bin" in step for way in found(failed(into, UnreachableError("far"), far)) for step in way
    )
    pick = SkillCall(skill="pick", arguments={"object": "bin"})
    ways = found(failed(pick, UnreachableError("far"), replace(far, hands={"hand": None})))
    assert ["push(object=bin, direction=back, distance=0.06)", "pick(object=bin)"] in ways


def test_what_lies_in_the_thing_itself_has_no_repairs() -> None:
    evidence = GraspEvidence(object="cube", reason="immovable", aperture=0.04, max_aperture=0.08, pull=50.0)
    error = GraspError("bolted", phase=Phase.LIFT, evidence=evidence)
    assert found(failed(SkillCall(skill="pick", arguments={"object": "cube"}), error, LOADED)) == []


def test_neighbours_that_are_kept_apart_are_cleared_before_what_stays_where_it_is() -> None:
    bowl = DetectedObject(
        id="bowl", kind="bowl", size=(0.05, 0.05), colour="", rgba=GREY, pose=Pose(xyz=(0.1, 0.1, 0.04))
    )
    around = scene(box("cube", 0.1, 0.0), box("block", 0.1, -0.05), bowl)
    error = in_the_way("hand", "bowl")
    ways = found(failed(SkillCall(skill="pick", arguments={"object": "cube"}), error, around))
    order = [way for way in ways if "object=bowl" in way[0] or "object=block" in way[0]]
    assert "object=block" in order[0][0] and any("object=bowl" in way[0] for way in order)


def test_what_a_thing_lies_in_is_not_moved_out_of_its_way() -> None:
    vessel = DetectedObject(
        id="bin", kind="bin", size=(0.08, 0.08, 0.06), colour="", rgba=GREY, pose=Pose(xyz=(0.1, 0.0, 0.04))
    )
    for place, moved in (((0.1, 0.05), False), ((0.1, 0.2), True)):
        around = scene(box("cube", *place), vessel)
        ways = found(failed(SkillCall(skill="pick", arguments={"object": "cube"}), in_the_way("hand", "bin"), around))
        assert any("object=bin" in call for way in ways for call in way) is moved


def test_a_bowl_turned_over_is_taken_off_what_lies_under_it() -> None:
    bowl = DetectedObject(
        id="bowl",
        kind="bowl",
        size=(0.06, 0.05),
        colour="",
        rgba=GREY,
        pose=Pose(xyz=(0.1, 0.03, 0.1), quat_xyzw=(1.0, 0.0, 0.0, 0.0)),
    )
    under = scene(box("cube", 0.1, 0.0), bowl)
    assert lies_in(under.objects[0], bowl)
    ways = found(failed(SkillCall(skill="pick", arguments={"object": "cube"}), in_the_way("hand", "bowl"), under))
    assert any("object=bowl" in call for way in ways for call in way)


def test_a_promise_that_holds_seen_from_when_the_call_began_is_mended() -> None:
    before = scene(box("cube", 0.1, 0.0))
    call = SkillCall(skill="push", arguments={"object": "cube", "direction": "left", "distance": 0.1})
    failure = failed(call, PushError("short", phase=Phase.VERIFY), before)
    assert failure.is_mended(replace(before, objects=(box("cube", 0.1, 0.1),)))
    assert not failure.is_mended(replace(before, objects=(box("cube", 0.1, 0.05),)))


def test_check_skill_tells_of_an_alternative_that_names_no_relation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SKILLS, "wipe", Wipe())
    failure = failed(
        SkillCall(skill="wipe", arguments={"object": "cube"}), in_the_way("cube", "lid", Phase.CHECK), LOADED
    )
    check_alternatives(SKILLS["wipe"], failure)
    wrong = Alternative(why="wiped dry", first=(fact("dry", "cube"),))
    monkeypatch.setattr(Wipe, "alternatives", lambda self, failure, *, object: iter([wrong]))
    with pytest.raises(AssertionError, match="no relation is called 'dry'"):
        check_alternatives(SKILLS["wipe"], failure)
