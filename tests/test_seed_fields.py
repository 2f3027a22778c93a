"""What the user's pages state of each field of a sidecar, tried on a Panda that has theirs."""

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml
from support.seed_pages import PAGES, PANDA, TUTORIAL, sidecars

from robosandbox.errors import InputError
from robosandbox.robots.check.diagnosis import static_checks
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Scene
from robosandbox.types.robot import RobotFiles


@dataclass
class Own:
    """A copy of the Panda's files whose sidecar is the page's.

    Attributes:
        folder: Where they are.
        side: The sidecar's data; a change counts from the next `load` on.
    """

    folder: Path
    side: dict[str, Any] = field(default_factory=lambda: yaml.safe_load(sidecars(TUTORIAL)[0]))

    def write(self) -> Path:
        shutil.copytree(PANDA, self.folder, dirs_exist_ok=True)
        path = self.folder / "panda.robosandbox.yaml"
        path.write_text(yaml.safe_dump(self.side))
        return path

    def load(self) -> MuJoCoBackend:
        self.write()
        sim = MuJoCoBackend()
        sim.load(Scene(robot_urdf=self.folder / "panda.xml"))
        return sim

    def blamed(self) -> set[str]:
        """Return the fields that static checks find wrong."""
        path = self.write()
        checks = static_checks(RobotFiles(model=path.with_name("panda.xml"), sidecar=path))
        return {item.field for item in checks if item.field and not item.ok}


def _arm_joints_are_in_order(sim: MuJoCoBackend, own: Own) -> None:
    assert list(sim.robot.joints) == own.side["arm"]["joints"]
    depth = [int(sim.model.body_parentid[sim.model.jnt_bodyid[_joint(sim, name)]]) for name in sim.robot.joints]
    assert depth == sorted(depth)
    own.side["arm"]["joints"].reverse()
    assert "arm.joints" in own.blamed()


def _each_joint_has_an_actuator_that_skills_write_to(sim: MuJoCoBackend, own: Own) -> None:
    driven = [sim.model.actuator_trnid[actuator, 0] for actuator in sim.robot.actuator_ids]
    names = [sim.model.actuator(actuator).name.rpartition("/")[2] for actuator in sim.robot.actuator_ids]
    assert driven == [_joint(sim, name) for name in sim.robot.joints] and names == own.side["arm"]["actuators"]
    own.side["arm"]["actuators"].pop()
    with pytest.raises(InputError, match=r"arm\.actuators: has 6 entries for 7 joints"):
        own.load()


def _home_has_a_value_per_joint(sim: MuJoCoBackend, own: Own) -> None:
    assert len(own.side["arm"]["home_qpos"]) == len(own.side["arm"]["joints"])
    assert sim.state().q == pytest.approx(own.side["arm"]["home_qpos"], abs=0.01)
    own.side["arm"]["home_qpos"].append(0.0)
    with pytest.raises(InputError, match=r"arm\.home_qpos: has 8 entries for 7 joints"):
        own.load()


def _primary_joint_gives_the_width(sim: MuJoCoBackend, own: Own) -> None:
    joint = _joint(sim, own.side["gripper"]["primary_joint"])
    assert sim.robot.gripper is not None and sim.robot.gripper.qpos_index == sim.model.jnt_qposadr[joint]
    widths = []
    for closed in (0.0, 0.5):
        sim.hands["hand"].set_gripper(closed=closed)
        sim.wait(1.0)
        state = sim.state().gripper
        assert state is not None
        widths.append(state.width)
        assert state.width == pytest.approx(2.0 * state.joint, abs=0.002)
    assert widths[1] < 0.6 * widths[0]
    own.side["gripper"]["primary_joint"] = "finger_joint2"
    assert "gripper.primary_joint" in own.blamed()


def _open_and_closed_are_joint_values(sim: MuJoCoBackend, own: Own) -> None:
    for closed, value in ((0.0, own.side["gripper"]["open_qpos"]), (1.0, own.side["gripper"]["closed_qpos"])):
        sim.hands["hand"].set_gripper(closed=closed)
        sim.wait(2.0)
        state = sim.state().gripper
        assert state is not None and state.joint == pytest.approx(value, abs=0.001)
    (wide,) = {match for page in PAGES for match in re.findall(r"open_qpos: .*~(\d+) mm between fingertips", page.text)}
    sim.hands["hand"].set_gripper(closed=0.0)
    sim.wait(1.0)
    state = sim.state().gripper
    assert state is not None and 1e3 * state.width == pytest.approx(float(wide), abs=2.0)
    own.side["gripper"]["open_qpos"] = float(wide) / 1e3
    with pytest.raises(InputError, match=r"gripper\.open_qpos: 0\.08 .* give a joint value, not a width"):
        own.load()


def _tcp_rides_on_its_body(sim: MuJoCoBackend, own: Own) -> None:
    inject = own.side["ee_site"]["inject"]
    data = mujoco.MjData(sim.model)
    data.qpos[sim.robot.qpos_indices] = sim.robot.home_q
    mujoco.mj_kinematics(sim.model, data)
    body = next(b for b in range(sim.model.nbody) if sim.model.body(b).name.endswith(f"/{inject['attach_body']}"))
    expected = data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(inject["xyz"])
    assert sim.robot.tcp(data)[0] == pytest.approx(expected, abs=1e-9)
    inject["attach_body"] = "handle"
    with pytest.raises(InputError, match=r"ee_site\.inject\.attach_body:? 'handle' is not a body"):
        own.load()


def _base_stands_in_the_world_beside_the_table(sim: MuJoCoBackend, own: Own) -> None:
    assert sim.robot.base_position == pytest.approx(own.side["base_pose"]["xyz"])
    stated = re.search(r"\((-[\d.]+)\.\.([\d.]+)\) x \((-[\d.]+)\.\.([\d.]+)\) at z ≈ ([\d.]+) m", TUTORIAL.text)
    assert stated is not None
    x_min, x_max, y_min, y_max, top = map(float, stated.groups())
    geom = next(g for g in range(sim.model.ngeom) if sim.model.body(sim.model.geom_bodyid[g]).name == "table")
    data = mujoco.MjData(sim.model)
    mujoco.mj_kinematics(sim.model, data)
    centre, half = data.geom_xpos[geom], sim.model.geom_size[geom]
    assert [*(centre - half)[:2], *(centre + half)] == pytest.approx([x_min, y_min, x_max, y_max, top])


STATED: dict[str, Callable[[MuJoCoBackend, Own], None]] = {
    "arm.joints": _arm_joints_are_in_order,
    "arm.actuators": _each_joint_has_an_actuator_that_skills_write_to,
    "arm.home_qpos": _home_has_a_value_per_joint,
    "gripper.primary_joint": _primary_joint_gives_the_width,
    "gripper.open_qpos": _open_and_closed_are_joint_values,
    "gripper.closed_qpos": _open_and_closed_are_joint_values,
    "ee_site.inject.attach_body": _tcp_rides_on_its_body,
    "ee_site.inject.xyz": _tcp_rides_on_its_body,
    "base_pose.xyz": _base_stands_in_the_world_beside_the_table,
}


def _stated_fields() -> list[str]:
    """Return the fields that the pages' lists explain; `a.{b, c}` and `a.b / c` name two."""
    found = []
    for line in (line for page in PAGES for line in page.text.splitlines()):
        # The pages lost the dash between one field and its text.
        match = re.match(r"\s*(?:•|\d+\.) ([a-z_]+\.(?:(?! — |len\().)+)(?: — |len\()", line)
        if match is not None:
            stem, _, last = match[1].rpartition(".")
            found += [f"{stem}.{name.strip(' {}')}" for name in re.split(r"[,/]", last)]
    return list(dict.fromkeys(found))


def _joint(sim: MuJoCoBackend, name: str) -> int:
    return next(j for j in range(sim.model.njnt) if sim.model.joint(j).name.endswith(f"/{name}"))


def test_list_of_fields_is_thesidecars() -> None:
    assert set(_stated_fields()) == set(STATED)


@pytest.mark.parametrize("stated", _stated_fields())
def test_what_is_stated_of_a_field_holds(stated: str, tmp_path: Path) -> None:
    own = Own(tmp_path)
    with own.load() as sim:
        STATED[stated](sim, own)
