"""Success criteria on made-up states: no physics."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from pydantic import TypeAdapter

from robosandbox.errors import InputError
from robosandbox.tasks.evaluate import evaluate
from robosandbox.tasks.judge.checks import Check
from robosandbox.tasks.judge.rest import any_moved, rests_for_good
from robosandbox.tasks.success import Criterion
from robosandbox.types import ArmTruth, ObjectKind, ObjectTruth, Pose, SceneObject, Touch, Truth, Verdict, frozen_array
from robosandbox.types.solids import solids_as_written

SIZES: dict[ObjectKind, tuple[float, ...]] = {
    "box": (0.02, 0.02, 0.02),
    "sphere": (0.01,),
    "bin": (0.06, 0.06, 0.05),
    "bowl": (0.05, 0.04),
    "drawer": (0.2, 0.15, 0.1, 0.1),
}
Where = tuple[ObjectKind, tuple[float, float, float]]


def truth(time: float = 0.0, q: float = 0.0, touched: str = "", **objects: Where) -> Truth:
    return Truth(
        time=time,
        arms={"arm": ArmTruth(q=frozen_array([q, 0.0]), home_q=frozen_array([0.0, 0.0]))},
        hands={"hand": None},
        table_height=0.04,
        objects={
            name: placed(
                ObjectTruth(
                    id=name,
                    kind=kind,
                    size=SIZES[kind],
                    rgba=(1, 0, 0, 1),
                    pose=Pose(xyz=xyz),
                    linear_velocity=np.zeros(3),
                    angular_velocity=np.zeros(3),
                    contacts=("robot",) if name == touched else (),
                ),
            )
            for name, (kind, xyz) in objects.items()
        },
    )


def placed(item: ObjectTruth, **changes: Any) -> ObjectTruth:
    """The object with changes, made of what its shape is made of, where it is."""
    item = replace(item, **changes)
    written = SceneObject(id=item.id, kind=item.kind, size=item.size, pose=item.pose)
    return replace(item, solids=solids_as_written(written, item.pose, item.opening))


def judged(criterion: Check, now: Truth) -> Verdict:
    """Judge in a world in which all stays as it is while time goes on."""
    clock = [now.time]

    def wait(seconds: float) -> None:
        clock[0] += seconds

    return evaluate(criterion, START, lambda: replace(now, time=clock[0]), wait)


def check(**fields: Any) -> Check:
    parsed: Check = TypeAdapter(Criterion).validate_python(fields)
    return parsed


A_LOW: Where = ("box", (0.0, 0.0, 0.06))
B_LOW: Where = ("box", (0.1, 0.0, 0.06))
A_ON_B: Where = ("box", (0.1, 0.0, 0.10))
START = truth(a=A_LOW, b=B_LOW)


@pytest.mark.parametrize(
    ("fields", "now", "holds"),
    [
        ({"kind": "lifted", "object": "a", "min_mm": 50}, truth(a=("box", (0, 0, 0.12)), b=B_LOW), True),
        ({"kind": "lifted", "object": "a", "min_mm": 70}, truth(a=("box", (0, 0, 0.12)), b=B_LOW), False),
        ({"kind": "on", "object": "a", "target": "b"}, truth(a=A_ON_B, b=B_LOW), True),
        ({"kind": "on", "object": "a", "target": "b"}, truth(a=A_ON_B, b=B_LOW, touched="a"), False),
        ({"kind": "on", "object": "a", "target": "table"}, START, True),
        ({"kind": "beside", "object": "a", "target": "b", "side": "front"}, START, True),
        ({"kind": "beside", "object": "a", "target": "b", "side": "left"}, START, False),
        ({"kind": "displaced", "object": "a", "direction": "left", "min_mm": 40}, truth(a=("box", (0, 0.05, 0.06)), b=B_LOW), True),
        ({"kind": "displaced", "object": "a", "direction": "right", "min_mm": 40}, truth(a=("box", (0, 0.05, 0.06)), b=B_LOW), False),
        ({"kind": "at_home"}, truth(q=0.01), True),
        ({"kind": "at_home"}, truth(q=-0.2), False),
        ({"kind": "undisturbed", "object": "b"}, truth(a=A_ON_B, b=B_LOW), True),
        ({"kind": "undisturbed", "except": ["a"]}, truth(a=A_ON_B, b=B_LOW), True),
        ({"kind": "undisturbed", "except": []}, truth(a=A_ON_B, b=B_LOW), False),
        ({"kind": "not", "check": {"kind": "at_home"}}, truth(q=1.0), True),
        ({"kind": "all", "checks": [{"kind": "at_home"}, {"kind": "lifted", "object": "a"}]}, START, False),
        ({"kind": "any", "checks": [{"kind": "at_home"}, {"kind": "lifted", "object": "a"}]}, START, True),
    ],
)  # fmt: skip
def test_criterion_says(fields: dict[str, Any], now: Truth, holds: bool) -> None:
    verdict = judged(check(**fields), now)
    assert verdict.success is holds


def test_inside_counts_only_what_was_let_go() -> None:
    criterion = check(kind="inside", object="a", target="tray")
    inside = truth(a=("box", (0.0, 0.0, 0.064)), tray=("bin", (0, 0, 0.04)))
    held = truth(a=("box", (0.0, 0.0, 0.064)), tray=("bin", (0, 0, 0.04)), touched="a")
    assert criterion.evaluate(inside, inside) and not criterion.evaluate(held, held)


def test_in_place_of_compares_with_where_the_target_was() -> None:
    swapped = truth(a=("box", (0.1, 0.005, 0.06)), b=("box", (0.0, 0.0, 0.06)))
    criterion = check(kind="in_place_of", object="a", target="b", max_mm=10)
    assert criterion.evaluate(START, swapped) and not criterion.evaluate(START, START)
    assert not criterion.evaluate(START, truth(a=A_ON_B, b=B_LOW)), "on it is not in its place"
    assert not criterion.evaluate(START, truth(touched="a", a=B_LOW, b=A_LOW)), "not while it is held"


def test_in_place_of_counts_both_directions_on_the_table_and_not_the_height() -> None:
    for x, y, holds in ((0.1, 0.0199, True), (0.1, 0.0201, False), (0.1, -0.0201, False), (0.115, 0.015, False)):
        now = truth(a=("box", (x, y, 0.0649)), b=A_LOW)
        assert bool(check(kind="in_place_of", object="a", target="b").evaluate(START, now)) is holds


def test_details_are_prefixed_only_where_checks_are_about_several_objects() -> None:
    still = {"kind": "undisturbed", "except": ["a"]}
    alone = check(kind="all", checks=[LIFTED, still]).evaluate(truth(a=A_LOW), truth(a=A_LOW))
    assert list(alone.detail) == ["dz_mm", "min_mm"]
    both = check(kind="all", checks=[LIFTED, {"kind": "lifted", "object": "b"}, still]).evaluate(START, START)
    assert list(both.detail) == ["a.dz_mm", "a.min_mm", "b.dz_mm", "b.min_mm", "moved_mm", "max_mm"]


def test_poured_counts_what_was_in_the_source() -> None:
    def balls(*x: float) -> dict[str, Where]:
        return {f"ball{i}": ("sphere", (at, 0.0, 0.055)) for i, at in enumerate(x)}

    cups: dict[str, Where] = {"cup": ("bowl", (0.0, 0.0, 0.04)), "bowl": ("bowl", (0.2, 0.0, 0.04))}
    criterion = check(kind="poured", object="cup", target="bowl", min_fraction=0.5, max_spilled=0.3)
    start = truth(**cups, **balls(0.0, 0.01, 0.02, -0.01))
    assert criterion.evaluate(start, truth(**cups, **balls(0.2, 0.21, 0.19, 0.4)))
    assert not criterion.evaluate(start, truth(**cups, **balls(0.2, 0.21, 0.4, 0.4)))
    assert not criterion.evaluate(start, start)
    assert not criterion.evaluate(truth(**cups), truth(**cups)), "nothing in the cup is nothing poured"


def judged_while_falling(fields: dict[str, Any], falls_after: float) -> Verdict:
    """Judge in a world in which `a` is lifted and falls some seconds after the episode."""
    clock = [0.0]

    def wait(seconds: float) -> None:
        clock[0] += seconds

    def look() -> Truth:
        return truth(time=clock[0], a=("box", (0, 0, 0.06 if clock[0] > falls_after else 0.20)), b=B_LOW)

    return evaluate(check(**fields), START, look, wait)


LIFTED = {"kind": "lifted", "object": "a", "min_mm": 50}


def test_hold_fails_what_does_not_last() -> None:
    assert judged_while_falling({**LIFTED, "hold_s": 1.0}, falls_after=2.5).success
    verdict = judged_while_falling({**LIFTED, "hold_s": 1.0}, falls_after=0.5)
    assert not verdict.success and math.isclose(verdict.detail["held_s"], 0.6)


def test_what_moves_on_and_on_is_not_done_and_what_comes_to_lie_still_is() -> None:
    clock = [0.0]

    def wait(seconds: float) -> None:
        clock[0] += seconds

    def judged_until(stops: float) -> Verdict:
        clock[0] = 0.0
        moved = lambda: truth(time=clock[0], a=("box", (0.1 + 0.02 * min(clock[0], stops), 0.0, 0.06)), b=B_LOW)  # noqa: E731
        return evaluate(check(**FORWARD), START, moved, wait)

    assert judged_until(3.0).success
    verdict = judged_until(99.0)
    assert not verdict.success and math.isclose(verdict.detail["moving_s"], 6.0)


def test_what_turns_on_and_on_at_one_place_is_not_done() -> None:
    clock = [0.0]

    def wait(seconds: float) -> None:
        clock[0] += seconds

    def judged_until(stops: float) -> Verdict:
        clock[0] = 0.0
        look = lambda: replace(turned("z", 0.2 * min(clock[0], stops)), time=clock[0])  # noqa: E731
        return evaluate(check(**ON_TABLE), START, look, wait)

    assert judged_until(3.0).success
    verdict = judged_until(99.0)
    assert not verdict.success and math.isclose(verdict.detail["moving_s"], 6.0)


def test_each_check_of_all_holds_for_its_own_time() -> None:
    home = {"kind": "at_home", "hold_s": 3.0}
    assert judged_while_falling({"kind": "all", "checks": [{**LIFTED, "hold_s": 1.0}, home]}, falls_after=2.5).success
    assert not judged_while_falling({"kind": "all", "hold_s": 3.0, "checks": [LIFTED, home]}, falls_after=2.5).success


def test_hold_reaches_into_not() -> None:
    low = {"kind": "on", "object": "a", "target": "table"}
    assert judged_while_falling({"kind": "not", "check": low}, falls_after=0.5).success
    assert not judged_while_falling({"kind": "not", "check": low, "hold_s": 1.0}, falls_after=0.5).success


def test_detail_of_a_single_check_is_what_the_bench_prints() -> None:
    verdict = judged_while_falling(LIFTED, falls_after=2.5)
    assert {key: round(value, 3) for key, value in verdict.detail.items()} == {"dz_mm": 140.0, "min_mm": 50.0}


# Where each criterion turns from true to false: both sides of every limit, 0.1 mm (or as little of another unit) from it.

EPS = 1e-4


def world(**changes: Any) -> Truth:
    """The start with some fields of `a` replaced, all else as it was."""
    start = truth(a=A_LOW, b=("box", (0.3, 0.3, 0.06)))
    return replace(start, objects={**start.objects, "a": placed(start.objects["a"], **changes)})


def at(x: float, y: float, z: float) -> Truth:
    return world(pose=Pose(xyz=(x, y, z)))


def beside_b(gap: float, up: float = 0.0, across: float = 0.0) -> Truth:
    """`a` to the left of `b`, with so much room between them, so much higher and further back."""
    now = truth(a=("box", (0.1 + across, 0.04 + gap, 0.06 + up)), b=B_LOW)
    return now


def in_tray(x: float, bottom: float, kind: ObjectKind = "bin") -> Truth:
    """`a` off the middle of a container on the table by x, its lowest point so high above the table."""
    return truth(a=("box", (x, 0.0, 0.06 + bottom)), tray=(kind, (0.0, 0.0, 0.04)))


def opened(opening: float) -> Truth:
    return replace_object(truth(a=("drawer", (0.0, 0.0, 0.04))), opening=opening)


def turned(
    about: str, angle: float, kind: ObjectKind = "box", xyz: tuple[float, float, float] = (0.2, 0.1, 0.06)
) -> Truth:
    """`a` turned about an axis of the world by an angle, radians."""
    x, y, z = (math.sin(angle / 2) * float(axis == about) for axis in "xyz")
    return replace_object(truth(a=(kind, xyz), b=B_LOW), pose=Pose(xyz=xyz, quat_xyzw=(x, y, z, math.cos(angle / 2))))


def replace_object(state: Truth, **changes: Any) -> Truth:
    return replace(state, objects={**state.objects, "a": placed(state.objects["a"], **changes)})


def joints(*errors: float) -> Truth:
    return replace(START, arms={"arm": replace(START.arms["arm"], q=frozen_array(errors))})


ON_B = {"kind": "on", "object": "a", "target": "b"}
ON_TABLE = {"kind": "on", "object": "a", "target": "table"}
IN_TRAY = {"kind": "inside", "object": "a", "target": "tray"}
LEFT_OF_B = {"kind": "beside", "object": "a", "target": "b", "side": "left"}
FORWARD = {"kind": "displaced", "object": "a", "direction": "forward", "min_mm": 40}
IN_PLACE = {"kind": "in_place_of", "object": "a", "target": "b"}
OPENED = {"kind": "opened", "object": "a", "min_mm": 80}
CLOSED = {"kind": "closed", "object": "a"}
TAPPED = {"kind": "tapped", "object": "a"}
ABOVE_B = {"kind": "moved_above", "object": "a", "target": "b"}
AT = {"kind": "at", "object": "a", "x": 0.2, "y": 0.1}
TURNED = {**AT, "yaw": 0.5}
UPRIGHT = {"kind": "upright", "object": "a"}
HOME = {"kind": "at_home"}
STILL = {"kind": "undisturbed", "except": []}


def on_b(x: float, up: float) -> Truth:
    return truth(a=("box", (0.1 + x, 0.0, 0.10 + up)), b=B_LOW)


def instead_of_b(x: float, up: float) -> Truth:
    return truth(a=("box", (0.1 + x, 0.0, 0.06 + up)), b=A_LOW)


@pytest.mark.parametrize(
    ("fields", "make", "limit", "grows"),
    [
        ({"kind": "lifted", "object": "a"}, lambda v: at(0, 0, 0.06 + v), 0.050, True),
        (ON_B, lambda v: on_b(0.0, v), 0.005, False),
        (ON_B, lambda v: on_b(0.0, v), -0.005, True),
        (ON_B, lambda v: on_b(v, 0.0), 0.020, False),
        (ON_B, lambda v: on_b(v, 0.0), -0.020, True),
        (ON_TABLE, lambda v: at(0, 0, 0.06 + v), 0.005, False),
        (ON_TABLE, lambda v: at(0, 0, 0.06 + v), -0.005, True),
        (IN_TRAY, lambda v: in_tray(v, 0.004), 0.060, False),
        (IN_TRAY, lambda v: in_tray(v, 0.004), -0.060, True),
        (IN_TRAY, lambda v: in_tray(v, 0.004, "bowl"), 0.050, False),
        (IN_TRAY, lambda v: in_tray(0.0, v), 0.050, False),
        (IN_TRAY, lambda v: in_tray(0.0, v), -0.001, True),
        (LEFT_OF_B, lambda v: beside_b(v), 0.100, False),
        (LEFT_OF_B, lambda v: beside_b(v), -0.005, True),
        (LEFT_OF_B, lambda v: beside_b(0.03, v), 0.005, False),
        (LEFT_OF_B, lambda v: beside_b(0.03, v), -0.005, True),
        (LEFT_OF_B, lambda v: beside_b(0.03, across=v), 0.070, False),
        (LEFT_OF_B, lambda v: beside_b(0.03, across=v), -0.070, True),
        (FORWARD, lambda v: at(v, 0, 0.06), 0.040, True),
        (FORWARD, lambda v: at(0.05, v, 0.06), 0.050, False),
        (FORWARD, lambda v: at(0.05, v, 0.06), -0.050, True),
        (IN_PLACE, lambda v: instead_of_b(v, 0.0), 0.020, False),
        (IN_PLACE, lambda v: instead_of_b(v, 0.0), -0.020, True),
        (IN_PLACE, lambda v: instead_of_b(0.0, v), 0.005, False),
        (IN_PLACE, lambda v: instead_of_b(0.0, v), -0.005, True),
        (OPENED, opened, 0.080, True),
        (CLOSED, opened, 0.003, False),
        (TAPPED, lambda v: world(felt=v), 0.1, True),
        (TAPPED, lambda v: world(felt=v), 30.0, False),
        ({**TAPPED, "max_n": 5.0}, lambda v: world(felt=v), 5.0, False),
        (ABOVE_B, lambda v: on_b(v, 0.0), 0.020, False),
        (ABOVE_B, lambda v: on_b(v, 0.0), -0.020, True),
        (ABOVE_B, lambda v: on_b(0.0, v), -0.020, True),
        ({**ABOVE_B, "xy_tol": 0.030}, lambda v: on_b(v, 0.0), 0.030, False),
        ({**ABOVE_B, "min_dz": 0.030}, lambda v: on_b(0.0, v), -0.010, True),
        (AT, lambda v: at(0.2 + v, 0.1, 0.06), 0.015, False),
        (AT, lambda v: at(0.2, 0.1 - v, 0.06), 0.015, False),
        (AT, lambda v: at(0.2, 0.1, 0.06 + v), 0.005, False),
        (TURNED, lambda v: turned("z", 0.5 + v), math.radians(10.0), False),
        (TURNED, lambda v: turned("z", 0.5 + v), -math.radians(10.0), True),
        (UPRIGHT, lambda v: turned("x", v), math.radians(30.0), False),
        (HOME, lambda v: joints(v, 0.0), 0.05, False),
        (HOME, lambda v: joints(0.0, v), -0.05, True),
        (STILL, lambda v: truth(a=("box", (v, 0, 0.06)), b=B_LOW), 0.010, False),
        (STILL, lambda v: truth(a=("box", (0, v, 0.06)), b=B_LOW), -0.010, True),
        (STILL, lambda v: truth(a=A_LOW, b=("box", (0.1, 0, 0.06 + v))), 0.010, False),
        ({"kind": "undisturbed", "object": "b"}, lambda v: truth(a=A_LOW, b=("box", (0.1, v, 0.06))), 0.010, False),
        ({**STILL, "max_mm": 25}, lambda v: truth(a=("box", (v, 0, 0.06)), b=B_LOW), 0.025, False),
    ],
)
def test_a_criterion_turns_at_its_limit(
    fields: dict[str, Any], make: Callable[[float], Truth], limit: float, grows: bool
) -> None:
    criterion = check(**fields)
    assert bool(criterion.evaluate(START, make(limit + EPS))) is grows
    assert bool(criterion.evaluate(START, make(limit - EPS))) is not grows


@pytest.mark.parametrize(
    ("fields", "now"),
    [
        (ON_B, truth(a=A_ON_B, b=B_LOW)),
        (ON_TABLE, START),
        (IN_TRAY, in_tray(0.0, 0.004)),
        (LEFT_OF_B, beside_b(0.03)),
        (IN_PLACE, instead_of_b(0.0, 0.0)),
        (AT, at(0.2, 0.1, 0.06)),
    ],
)
def test_what_is_put_somewhere_was_let_go_of_by_the_robot(fields: dict[str, Any], now: Truth) -> None:
    criterion = check(**fields)
    for contacts, holds in (((), True), (("b", "table"), True), (("b", "robot"), False)):
        verdict = criterion.evaluate(START, replace_object(now, contacts=contacts))
        assert verdict.holds is holds and verdict.detail["touched"] == float(not holds)


@given(in_source=st.integers(0, 6), in_target=st.integers(0, 6), spilled=st.integers(0, 6), tenths=st.integers(0, 10))
def test_poured_turns_at_its_fractions(in_source: int, in_target: int, spilled: int, tenths: int) -> None:
    count = in_source + in_target + spilled
    cups: dict[str, Where] = {"cup": ("bowl", (0.0, 0.0, 0.04)), "bowl": ("bowl", (0.2, 0.0, 0.04))}

    def balls(where: list[float]) -> dict[str, Where]:
        return {f"ball{index}": ("sphere", (x, 0.0, 0.055)) for index, x in enumerate(where)}

    start = truth(**cups, **balls([0.0] * count))
    now = truth(**cups, **balls([0.0] * in_source + [0.2] * in_target + [0.4] * spilled))
    least = check(kind="poured", object="cup", target="bowl", min_fraction=tenths / 10, max_spilled=1.0)
    most = check(kind="poured", object="cup", target="bowl", min_fraction=0.0, max_spilled=tenths / 10)
    assert bool(least.evaluate(start, now)) is (count > 0 and 10 * in_target >= tenths * count)
    assert bool(most.evaluate(start, now)) is (count > 0 and 10 * spilled <= tenths * count)


@pytest.mark.parametrize(
    ("in_source", "in_target", "spilled", "holds"), [(0, 8, 2, True), (3, 7, 0, False), (0, 7, 3, False)]
)
def test_a_fifth_may_be_spilled_or_stay_unless_the_task_says_otherwise(
    in_source: int, in_target: int, spilled: int, holds: bool
) -> None:
    cups: dict[str, Where] = {"cup": ("bowl", (0.0, 0.0, 0.04)), "bowl": ("bowl", (0.2, 0.0, 0.04))}
    places = [0.0] * in_source + [0.2] * in_target + [0.4] * spilled

    def balls(places: list[float]) -> dict[str, Where]:
        return {f"ball{index}": ("sphere", (x, 0.0, 0.055)) for index, x in enumerate(places)}

    start, now = truth(**cups, **balls([0.0] * 10)), truth(**cups, **balls(places))
    assert bool(check(kind="poured", object="cup", target="bowl").evaluate(start, now)) is holds
    lenient = check(kind="poured", object="cup", target="bowl", min_fraction=0.5)
    assert bool(lenient.evaluate(start, now)) is (spilled <= 2)


def test_the_target_is_not_among_what_is_poured_into_it() -> None:
    nested: dict[str, Where] = {"cup": ("bowl", (0.0, 0.0, 0.04)), "bowl": ("bowl", (0.0, 0.0, 0.05))}
    start = truth(**nested, a=("sphere", (0.0, 0.0, 0.065)))
    assert check(kind="poured", object="cup", target="bowl").evaluate(start, start).detail["count"] == 1.0


def test_what_was_in_the_target_before_is_not_poured() -> None:
    cups: dict[str, Where] = {"cup": ("bowl", (0.0, 0.0, 0.04)), "bowl": ("bowl", (0.2, 0.0, 0.04))}
    start = truth(**cups, a=("sphere", (0.0, 0.0, 0.055)), b=("sphere", (0.2, 0.0, 0.055)))
    relation = check(kind="poured", object="cup", target="bowl").evaluate(start, start)
    assert not relation and relation.detail == {"fraction": 0.0, "spilled": 0.0, "count": 1.0}


@given(first=st.booleans(), second=st.booleans(), third=st.booleans())
def test_all_any_and_not_are_those_of_logic(first: bool, second: bool, third: bool) -> None:
    states = {"a": first, "b": second, "c": third}
    now = truth(**{name: ("drawer", (0.0, 0.3 * index, 0.04)) for index, name in enumerate(states)})
    now = replace(
        now, objects={name: placed(now.objects[name], opening=0.0 if shut else 0.08) for name, shut in states.items()}
    )
    checks = [{"kind": "closed", "object": name} for name in states]
    assert bool(check(kind="all", checks=checks).evaluate(now, now)) is (first and second and third)
    assert bool(check(kind="any", checks=checks).evaluate(now, now)) is (first or second or third)
    assert bool(check(kind="not", check=checks[0]).evaluate(now, now)) is not first


def test_a_drawer_that_does_not_say_how_far_it_is_open_is_not_guessed_at() -> None:
    unknown = truth(a=("drawer", (0.0, 0.0, 0.04)))
    for fields in (OPENED, CLOSED):
        with pytest.raises(InputError, match="'a': this world does not report"):
            check(**fields).evaluate(unknown, unknown)


def test_undisturbed_is_about_everything_but_what_is_excepted() -> None:
    moved = truth(a=("box", (0.05, 0, 0.06)), b=B_LOW)
    for fields, holds in (
        ({"kind": "undisturbed", "except": ["a"]}, True),
        ({"kind": "undisturbed", "except": ["b"]}, False),
        ({"kind": "undisturbed", "except": ["a", "b"]}, True),
        ({"kind": "undisturbed", "object": "a"}, False),
    ):
        assert bool(check(**fields).evaluate(START, moved)) is holds
    relation = check(kind="undisturbed", **{"except": []}).evaluate(START, moved)
    assert relation.detail == {"moved_mm": pytest.approx(50.0), "max_mm": 10.0}


@pytest.mark.parametrize(
    ("fields", "now", "detail"),
    [
        (OPENED, opened(0.05), {"opening_mm": 50.0, "min_mm": 80.0}),
        (CLOSED, opened(0.05), {"opening_mm": 50.0}),
        (TAPPED, world(felt=2.5), {"felt_n": 2.5}),
        (HOME, joints(0.01, -0.02), {"home_error": 0.02}),
        (IN_PLACE, instead_of_b(0.01, 0.0), {"off_mm": 10.0, "within_mm": 20.0, "touched": 0.0}),
    ],
)
def test_detail_names_what_was_measured(fields: dict[str, Any], now: Truth, detail: dict[str, float]) -> None:
    assert check(**fields).evaluate(START, now).detail == pytest.approx(detail)


def test_references_are_what_a_task_file_must_have() -> None:
    cases: list[tuple[dict[str, Any], list[tuple[str, str]]]] = [
        (ON_B, [("object", "a"), ("target", "b")]),
        (IN_PLACE, [("object", "a"), ("target", "b")]),
        ({"kind": "poured", "object": "a", "target": "b"}, [("object", "a"), ("target", "b")]),
        ({"kind": "undisturbed", "except": ["a", "b"]}, [("except[0]", "a"), ("except[1]", "b")]),
        ({"kind": "undisturbed", "object": "a"}, [("object", "a")]),
        (HOME, []),
        *(({**fields}, [("object", "a")]) for fields in (LIFTED, FORWARD, OPENED, CLOSED, TAPPED)),
    ]
    for fields, named in cases:
        assert [(part, name) for part, name, _ in check(**fields).references()] == named
    kinds = {kind for _, _, kinds in check(**IN_TRAY).references() for kind in kinds}
    assert {"bin", "drawer", "bowl", "cup"} <= kinds and "box" not in kinds
    assert [set(kinds) for _, _, kinds in check(**CLOSED).references()] == [{"drawer", "part"}]


# What carries a thing, and whether it is at rest: by forces at its contacts.


def standing(force: float = 0.25, other: str = "table", **changes: Any) -> ObjectTruth:
    """`a` on the table, as heavy as 1 N, with a force at each corner of its face."""
    corners = [(x, y, 0.04) for x in (-0.02, 0.02) for y in (-0.02, 0.02)]
    touches = tuple(Touch(other=other, point=corner, force=(0.0, 0.0, force)) for corner in corners)
    fields = {"touches": touches, "weight": 1.0, "mass_centre": (0.0, 0.0, 0.06), "contacts": (other,), **changes}
    return replace(START.objects["a"], **fields)


def alone(item: ObjectTruth, time: float = 0.0) -> Truth:
    return replace(START, time=time, objects={"a": item})


@pytest.mark.parametrize(
    ("item", "rests"),
    [
        (standing(), True),
        (standing(mass_centre=(0.0195, 0.0, 0.06)), False),
        (standing(force=0.2), False),
        (standing(linear_velocity=np.array([0.006, 0.0, 0.0])), False),
        (standing(linear_velocity=np.array([0.0049, 0.0, 0.0])), True),
        (standing(linear_velocity=np.array([0.0049, 0.0, 0.0]), mass_centre=(0.01895, 0.0, 0.54)), False),
        (standing(touches=None), False),
        (standing(touches=()), False),
        (standing(weight=None), False),
        (standing(other="robot"), False),
    ],
)
def test_nothing_is_waited_for_where_nothing_can_move_by_itself(item: ObjectTruth, rests: bool) -> None:
    assert rests_for_good(alone(item), alone(item)) is rests


def test_what_the_robot_holds_is_watched_for_a_while() -> None:
    held = alone(standing(other="robot"))
    for seconds, crept, rests in ((0.2, 0.0, False), (0.3, 0.0, True), (0.3, 0.0002, False)):
        later = standing(other="robot", pose=Pose(xyz=(0.0, 0.0, 0.06 - crept)))
        assert rests_for_good(held, alone(later, time=seconds)) is rests


def test_a_ball_that_turns_on_the_spot_has_not_moved() -> None:
    turned = Pose(xyz=(0.0, 0.0, 0.06), quat_xyzw=(0.0, 0.1, 0.0, math.sqrt(1.0 - 0.1**2)))
    for kind, pose, moved in (
        ("box", turned, True),
        ("sphere", turned, False),
        ("sphere", Pose(xyz=(0.003, 0.0, 0.06)), True),
    ):
        before = alone(standing(kind=kind, pose=Pose(xyz=(0.0, 0.0, 0.06))))
        assert any_moved(before, alone(standing(kind=kind, pose=pose)), ["a"]) is moved


@pytest.mark.parametrize(("share", "holds"), [(0.7, True), (0.3, False)])
def test_on_is_what_bears_most_of_a_thing(share: float, holds: bool) -> None:
    touches = tuple(
        Touch(other=other, point=(0.1, 0.0, 0.08), force=(0.0, 0.0, force))
        for other, force in (("b", share), ("table", 1.0 - share))
    )
    now = replace_object(truth(a=A_ON_B, b=B_LOW), touches=touches, weight=1.0)
    assert check(**ON_B).evaluate(START, now).holds is holds


def test_what_lies_on_a_drawers_handle_is_not_in_the_drawer() -> None:
    def at(x: float, bottom: float) -> Truth:
        return truth(a=("sphere", (x, 0.0, 0.04 + bottom + 0.01)), tray=("drawer", (0.0, 0.0, 0.04)))

    assert check(**IN_TRAY).evaluate(at(0.0, 0.009), at(0.0, 0.009))
    on_the_handle = at(-0.09, 0.06)
    finding = check(**IN_TRAY).evaluate(on_the_handle, on_the_handle)
    assert not finding and finding.detail["margin_mm"] > 0.0 and finding.detail["below_rim_mm"] > 0.0


def test_what_was_tipped_up_is_not_lifted_though_its_middle_rose() -> None:
    tipped = turned("x", math.radians(45.0), xyz=(0.0, 0.0, 0.04 + 0.02 * math.sqrt(2.0)))
    assert not check(kind="lifted", object="a", min_mm=5).evaluate(START, tipped)


def test_what_was_above_it_at_the_start_was_not_moved_there() -> None:
    above = on_b(0.0, 0.0)
    assert check(**ABOVE_B).evaluate(START, above) and not check(**ABOVE_B).evaluate(above, above)


@pytest.mark.parametrize(("kind", "upright"), [("box", True), ("bowl", False), ("bin", False)])
def test_a_box_stands_upright_on_either_end_and_a_container_only_with_its_opening_above(
    kind: ObjectKind, upright: bool
) -> None:
    over = turned("x", math.pi, kind)
    assert bool(check(**UPRIGHT).evaluate(over, over)) is upright
