"""Checks that any skill, planner or sim must pass; call them from your own tests.

    from robosandbox.testing import check_planner, check_sim, check_skill

Each raises AssertionError with a sentence that says which promise is broken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.errors import InvalidArgumentError, SkillError
from robosandbox.protocols import Driver, Planner, Skill, SkillContext
from robosandbox.types import ObservedScene, Plan, Refusal, SkillResult, Trajectory


def check_skill(skill: Skill, ctx: SkillContext, arguments: dict[str, object]) -> SkillResult | SkillError:
    """Run a skill once and check that it ends in one of the two ways a skill may end.

    Args:
        skill: The skill.
        ctx: A loaded world.
        arguments: Valid arguments for it.

    Returns:
        Its result, or the SkillError that it raised.
    """
    schema = skill.schema
    _demand(bool(skill.name) and bool(skill.description), f"{skill.name!r} lacks a name or a description")
    _demand(schema.get("type") == "object", f"{skill.name}: its schema is no JSON object schema")
    _demand(schema.get("additionalProperties") is False, f"{skill.name}: its schema admits unknown arguments")
    before = ctx.sim.time
    try:
        skill(ctx, {**arguments, "no_such_argument": 1})
    except InvalidArgumentError:
        _demand(ctx.sim.time == before, f"{skill.name}: time passed before its arguments were checked")
    else:
        raise AssertionError(f"{skill.name}: accepted an unknown argument")
    try:
        result = skill(ctx, arguments)
    except SkillError as error:
        _demand(bool(error.message), f"{skill.name}: raised {type(error).__name__} without a message")
        kind = type(error).evidence_type
        _demand(
            kind is None or isinstance(error.evidence, kind), f"{skill.name}: {type(error).__name__} lacks evidence"
        )
        return error
    _demand(isinstance(result, SkillResult), f"{skill.name}: returned {type(result).__name__}, not SkillResult")
    _demand(result.skill == skill.name, f"{skill.name}: its result is signed {result.skill!r}")
    return result


def check_planner(planner: Planner, scene: ObservedScene, skills: Sequence[Skill], prompts: Sequence[str]) -> None:
    """Check that a planner answers each prompt with a plan of known skills and arguments, or a refusal, repeatably."""
    schemas = {skill.name: skill.schema for skill in skills}
    for prompt in prompts:
        answer = planner.plan(prompt, scene)
        _demand(isinstance(answer, Plan | Refusal), f"{prompt!r}: answered with {type(answer).__name__}")
        _demand(answer == planner.plan(prompt, scene), f"{prompt!r}: two answers for the same scene")
        if isinstance(answer, Refusal):
            _demand(bool(answer.message), f"{prompt!r}: refused without a sentence")
            continue
        for call in answer.steps:
            _demand(call.skill in schemas, f"{prompt!r}: plans {call.skill!r}, which is no skill here")
            schema = schemas[call.skill]
            known, needed = schema.get("properties", {}), schema.get("required", [])
            _demand(set(call.arguments) <= set(known), f"{prompt!r}: {call} has unknown arguments")
            _demand(set(needed) <= set(call.arguments), f"{prompt!r}: {call} lacks arguments")


def check_sim(sim: Driver) -> None:
    """Check a loaded sim's promises: looking changes nothing, holding holds, motions arrive, hooks stop them."""
    first, second = sim.observe(), sim.observe()
    _demand(bool((first.q == second.q).all()) and first.time == second.time, "observe() changed the state")
    _demand(not first.q.flags.writeable, "an observation's arrays can be written to")
    sim.hold()
    sim.step(0.5)
    held = sim.observe()
    _demand(float(np.abs(held.q - first.q).max()) < 0.01, "the arm does not hold")
    _demand(abs(held.time - first.time - 0.5) < 1.5 * sim.control_timestep, "step(0.5) is not half a second")
    goal = held.q.copy()
    goal[0] += 0.1
    rows = 200
    sim.execute(Trajectory(q=np.linspace(held.q, goal, rows), dt=0.005))
    sim.step(0.5)
    _demand(float(np.abs(sim.observe().q - goal).max()) < 0.01, "a motion did not arrive")

    class Stop(Exception):
        pass

    ticks = []

    def stop() -> None:
        ticks.append(sim.time)
        if len(ticks) == 5:
            raise Stop

    sim.tick_hooks.append(stop)
    try:
        sim.execute(Trajectory(q=np.linspace(goal, held.q, rows), dt=0.005))
    except Stop:
        pass
    else:
        raise AssertionError("a hook that raises did not stop the motion")
    finally:
        sim.tick_hooks.remove(stop)
    stopped = sim.observe().q
    sim.step(0.5)
    _demand(float(np.abs(sim.observe().q - stopped).max()) < 0.02, "the arm went on after a hook stopped it")


def _demand(holds: bool, otherwise: str) -> None:
    if not holds:
        raise AssertionError(otherwise)
