"""Success criteria on made-up states: no physics."""

import math
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from robosandbox.sim.truth import ObjectTruth, Truth
from robosandbox.tasks.judge import Verdict, judge
from robosandbox.tasks.success import Check, Criterion
from robosandbox.types import ObjectKind, Pose, frozen_array

SIZES: dict[ObjectKind, tuple[float, ...]] = {
    "box": (0.02, 0.02, 0.02),
    "sphere": (0.01,),
    "bin": (0.06, 0.06, 0.05),
    "bowl": (0.05, 0.04),
}
Where = tuple[ObjectKind, tuple[float, float, float]]


def truth(time: float = 0.0, q: float = 0.0, touched: str = "", **objects: Where) -> Truth:
    return Truth(
        time=time,
        q=frozen_array([q, 0.0]),
        home_q=frozen_array([0.0, 0.0]),
        table_height=0.04,
        objects={
            name: ObjectTruth(
                id=name,
                kind=kind,
                size=SIZES[kind],
                rgba=(1, 0, 0, 1),
                pose=Pose(xyz=xyz),
                linear_velocity=np.zeros(3),
                angular_velocity=np.zeros(3),
                contacts=frozenset({"robot"} if name == touched else ()),
            )
            for name, (kind, xyz) in objects.items()
        },
    )


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
    verdict = judge(check(**fields), START, lambda: now, lambda _: None)
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

    return judge(check(**fields), START, look, wait)


LIFTED = {"kind": "lifted", "object": "a", "min_mm": 50}


def test_hold_fails_what_does_not_last() -> None:
    assert judged_while_falling({**LIFTED, "hold_s": 1.0}, falls_after=2.0).success
    verdict = judged_while_falling({**LIFTED, "hold_s": 1.0}, falls_after=0.5)
    assert not verdict.success and math.isclose(verdict.detail["held_s"], 0.6)


def test_each_check_of_all_holds_for_its_own_time() -> None:
    home = {"kind": "at_home", "hold_s": 3.0}
    assert judged_while_falling({"kind": "all", "checks": [{**LIFTED, "hold_s": 1.0}, home]}, falls_after=2.0).success
    assert not judged_while_falling({"kind": "all", "hold_s": 3.0, "checks": [LIFTED, home]}, falls_after=2.0).success


def test_hold_reaches_into_not() -> None:
    low = {"kind": "on", "object": "a", "target": "table"}
    assert judged_while_falling({"kind": "not", "check": low}, falls_after=0.5).success
    assert not judged_while_falling({"kind": "not", "check": low, "hold_s": 1.0}, falls_after=0.5).success


def test_detail_of_a_single_check_is_what_the_bench_prints() -> None:
    verdict = judged_while_falling(LIFTED, falls_after=2.0)
    assert {key: round(value, 3) for key, value in verdict.detail.items()} == {"dz_mm": 140.0, "min_mm": 50.0}
