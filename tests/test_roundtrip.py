"""What is inferred of a robot is taken back: checking and loading say what inference said, or refuse for its reason."""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import pytest
from support.models import wheel_files

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.robots.chains import Tool
from robosandbox.robots.infer.reach import collision_test
from robosandbox.robots.kinematics import Kinematics

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import roundtrip
import suction

TOYS = Path(__file__).parent / "toys"
# Every joint about the vertical: it never leaves its plane.
FLAT = """<mujoco model="flat"><compiler angle="radian"/><worldbody><body name="a"><joint name="j1" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/><body name="b" pos=".3 0 0"><joint name="j2" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/><body name="c" pos=".2 0 0"><joint name="j3" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 .1 0 0" size=".02"/></body></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("name", sorted(path.name for path in TOYS.glob("toy*.*") if path.suffix in (".xml", ".urdf")))
@pytest.mark.sample(every=2)
def test_toys_come_back_as_they_were_inferred(name):
    row = roundtrip.take(roundtrip.Case(name, TOYS / name))
    assert row.consistent and row.outcome in ("hand", "bare", "refused"), row


def test_a_cup_comes_back_as_it_was_inferred(tmp_path):
    row = roundtrip.take(roundtrip.Case("cup", suction.arm(tmp_path)))
    assert row.consistent and row.outcome == "hand", row


@pytest.mark.slow
@pytest.mark.parametrize("hand", ["Robotiq 140", "Inspire right"])
def test_hands_that_check_used_to_refuse_come_back(hand):
    folders = [wheel_files(wheel) for wheel in (roundtrip.SSCBIRRT, roundtrip.SUITE)]
    case = next(case for case in roundtrip.pairs(folders) if case.name == f"UR5e + {hand}")
    assert roundtrip.take(case).consistent


def test_what_check_would_refuse_is_refused_by_infer_for_the_same_cause(tmp_path, capsys):
    model = tmp_path / "flat.xml"
    model.write_text(FLAT, encoding="utf-8")
    assert run_app(app, "robo-sandbox", ("robot", "infer", str(model), "-o", str(tmp_path / "out.yaml"))) == 2
    said = capsys.readouterr().err
    assert "flat.xml: no usable sidecar can be inferred: home: singular: the tool cannot move one way" in said
    assert not (tmp_path / "out.yaml").exists()
    row = roundtrip.take(roundtrip.Case("flat", model))
    assert row.consistent and row.outcome == "refused", row


def test_a_contradiction_is_counted(tmp_path):
    row = roundtrip.Row("one", "hand", contradictions=["load: opens to 3 mm, inference said 80"])
    rows = [row, roundtrip.Row("two", "bare"), roundtrip.Row("three", "lost")]
    assert roundtrip.summary(rows) == "consistent 1 of 3: bare 1 of 1, hand 0 of 1, lost 0 of 1"


def test_parts_that_the_arm_does_not_move_against_each_other_are_no_collision():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body name='base'><geom size='.05'/><body name='link' pos='.2 0 0'>"
        "<joint name='j' axis='0 0 1'/><geom size='.03' pos='.2 0 0'/><body name='left' pos='.4 0 0'><joint name='f1' type='slide'/>"
        "<geom size='.02'/></body><body name='right' pos='.41 0 0'><joint name='f2' type='slide'/><geom size='.02'/></body>"
        "</body><body name='post' pos='.2 .3 0'><geom name='post' size='.04' pos='0 .1 0'/></body></body></worldbody></mujoco>"
    )
    kinematics = Kinematics(model, (0,), Tool(2, [0.4, 0.0, 0.0], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    touching = collision_test(model, kinematics)
    # The fingers overlap wherever the arm is; a quarter turn takes them into the post.
    assert touching([0.0]) is None
    assert "'post'" in touching([1.5708])
