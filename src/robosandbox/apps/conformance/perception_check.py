"""The check that any perception must pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from robosandbox.apps.conformance.conformance import demand
from robosandbox.driver import Driver, simulated
from robosandbox.perception.factory import Setup
from robosandbox.perception.protocols import Glancing, Perception
from robosandbox.shapes import shape_of, shapes
from robosandbox.sim.opening import open_mujoco
from robosandbox.types import ObjectTruth, ObservedScene, Scene

_PURPOSE = "a perception is checked beside it"
# Seconds between two looks at a scene in which nothing moves.
_PAUSE = 0.2


def check_perception(
    make: Callable[[Setup], Perception],
    scene: Scene,
    moved: Scene,
    *,
    tolerance: float = 0.01,
    sensor: str = "ideal",
) -> None:
    """Check a perception's promises on two simulated scenes, beside the simulated state.

    Args:
        make: Returns the perception, given what may be known of the place before the first look.
        scene: A robot, and objects in sight of its cameras with room around them.
        moved: The same objects elsewhere; the world starts over in it.
        tolerance: How far the middle of an object may be seen from where it is, metres.
        sensor: What the cameras are like: ideal, realsense, rough or webcam.

    Raises:
        AssertionError: With a sentence that says which promise is broken.
    """
    driver = open_mujoco(scene, sensor=sensor)
    try:
        perception = make(Setup.of(scene))
        demand(set(perception.view(driver).arms) == set(driver.arms), "view() returns a driver with other arms")
        first = _look(perception, driver, tolerance)
        _check_memory(perception, driver, first, tolerance)
        simulated(driver, _PURPOSE).reset(moved)
        _look(perception, driver, tolerance)
    finally:
        driver.close()


def _look(perception: Perception, driver: Driver, tolerance: float) -> ObservedScene:
    """Look, plan among what is seen, and return what is seen, which is what is there."""
    world = simulated(driver, _PURPOSE)
    before = world.snapshot()
    seen = perception.perceive(driver)
    perception.planning(driver, seen)
    demand(
        bool(np.array_equal(before, world.snapshot())), "a look, or planning among what it showed, changed the world"
    )
    demand(seen.time == driver.time, f"a look at {driver.time:g} s is said to be of {seen.time:g} s")
    _check_values(seen)
    _check_places(seen, world.truth(for_judging=False).objects.values(), tolerance)
    return seen


def _check_values(seen: ObservedScene) -> None:
    names = [item.id for item in seen.objects]
    demand(len(set(names)) == len(names), f"two things go by one id: {', '.join(names)}")
    for item in seen.objects:
        demand(item.kind in shapes(), f"{item.id}: {item.kind!r} is no installed kind")
        fields = shape_of(item.kind).size_fields
        known = len(item.size) == len(fields) or not fields
        demand(known and min(item.size) > 0.0, f"{item.id}: its size is {item.size}; a {item.kind} has {fields}")
        demand(bool(np.isfinite(item.pose.position).all()), f"{item.id}: its place is {item.pose.xyz}")
        demand(0.0 < item.confidence <= 1.0, f"{item.id}: its confidence is {item.confidence:g}, which is not in 0..1")
        demand(bool(item.colour), f"{item.id}: its colour has no name")


def _check_places(seen: ObservedScene, there: Iterable[ObjectTruth], tolerance: float) -> None:
    """Check that what is seen is what is there, each once."""
    left = list(seen.objects)
    for truth in there:
        real = truth.detected()
        middle = real.shape.centre(real)
        alike = [item for item in left if item.kind == real.kind or item.kind in real.shape.looks_like]
        away = [float(np.linalg.norm(item.shape.centre(item) - middle)) for item in alike]
        nearest = min(away, default=float("inf"))
        demand(
            nearest <= tolerance, f"{truth.id}: the nearest {real.kind} is seen {nearest:g} m from it, of {tolerance:g}"
        )
        left.remove(alike[away.index(nearest)])
    demand(not left, f"{', '.join(item.id for item in left)}: seen, and not there")


def _check_memory(perception: Perception, driver: Driver, first: ObservedScene, tolerance: float) -> None:
    """Check that names last while nothing moves, and that a glance tells of what it was asked for."""
    names = {item.id for item in first.objects}
    driver.wait(_PAUSE)
    again = {item.id for item in _look(perception, driver, tolerance).objects}
    demand(names == again, f"nothing moved, and {', '.join(sorted(names ^ again))} is called otherwise")
    if not isinstance(perception, Glancing):
        return
    for name in sorted(names):
        demand(perception.glance(driver, [name]).find(name) is not None, f"{name}: not seen where it was glanced at")
    demand({item.id for item in perception.glance(driver, []).objects} == names, "what is not looked at is forgotten")
    perception.doubt()
    demand({item.id for item in _look(perception, driver, tolerance).objects} == names, "a doubt changed the names")
