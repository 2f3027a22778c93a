"""Is a sidecar right for its robot? Checked against what the model itself shows, then in simulation up to a pick.

Each symptom of a wrong sidecar has one cause; a check that fails names the field to change.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robosandbox.apps.conformance.robot_trial import try_out
from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.robots.check.compare import compare
from robosandbox.robots.check.diagnosis import blamed_field, examine
from robosandbox.robots.findings import CheckResult
from robosandbox.robots.importers.files import searching
from robosandbox.robots.importers.imported import ImportedModel
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import RobotModel, load_robot
from robosandbox.robots.locate import find_sidecar, known_sidecar, resolve_robot
from robosandbox.robots.sidecar import Sidecar
from robosandbox.validation import load_yaml_model

OnCheck = Callable[[CheckResult], None]


@dataclass(slots=True)
class RobotReport:
    """Report of the checks of a robot.

    Attributes:
        loads: The model and the sidecar load.
        sidecar: The sidecar in use, as data; empty when it could not be read.
        checks: In the order in which they were made.
        on_check: Called with each check when it is made.
    """

    loads: bool = False
    sidecar: dict[str, Any] = field(default_factory=dict)
    checks: list[CheckResult] = field(default_factory=list)
    on_check: OnCheck | None = None

    def add(self, checks: Iterable[CheckResult]) -> None:
        """Take down checks as they are made."""
        for item in checks:
            self.checks.append(item)
            if self.on_check is not None:
                self.on_check(item)

    @property
    def ok(self) -> bool:
        """It loads and every check that counts passed; that an arm without a gripper cannot pick does not count."""
        return self.loads and all(item.ok or not item.counts for item in self.checks)

    def document(self) -> dict[str, Any]:
        """Return the report as JSON data."""
        return {
            "loads": self.loads,
            "ok": self.ok,
            "sidecar": self.sidecar,
            "checks": [
                {"name": item.name, "ok": item.ok, "detail": item.detail, "field": None if item.ok else item.field}
                for item in self.checks
            ],
        }


def check_robot(
    model: Path | str,
    *,
    sidecar: Path | None = None,
    gripper: Path | None = None,
    arm: str | None = None,
    package_paths: Iterable[Path] = (),
    on_check: OnCheck | None = None,
) -> RobotReport:
    """Check a robot.

    Args:
        model: URDF, MJCF, or a bundled robot's name.
        sidecar: Its sidecar; the one beside the model, a shipped one, or an inferred one when left out.
        gripper: A gripper's model to mount, when there is no sidecar that does.
        arm: Which arm, where the model has several and no sidecar says.
        package_paths: Where package:// names are looked up.
        on_check: Called with each check when it is made.

    Raises:
        InputError: The files cannot be found at all; what is wrong in them is in the report.
    """
    paths = tuple(Path(item) for item in package_paths)
    with searching(paths):
        return _check(model, sidecar, gripper, arm, paths, on_check)


def _check(
    model: Path | str,
    sidecar: Path | None,
    gripper: Path | None,
    arm: str | None,
    paths: tuple[Path, ...],
    on_check: OnCheck | None,
) -> RobotReport:
    report = RobotReport(on_check=on_check)
    path = resolve_robot(Path(model)).resolve()
    config = find_sidecar(path, sidecar)
    try:
        with doing(f"reading {path.name}"):
            imported = import_model(path, paths)
    except InputError as error:
        report.add([CheckResult("load", False, str(error))])
        return report
    if config is None and gripper is None and (known := known_sidecar(imported)) is not None:
        if _fits(path, known[0], paths):
            config = known[0]
        # It may have been written for a namesake of this model; trying it has changed what was imported.
        imported = import_model(path, paths)
    _check_with(report, path, imported, config, gripper, arm, paths)
    return report


def _fits(path: Path, config: Path, paths: tuple[Path, ...]) -> bool:
    """Tell whether a model loads with a sidecar."""
    try:
        load_robot(path, config, paths)
    except InputError:
        return False
    return True


def _check_with(
    report: RobotReport,
    path: Path,
    imported: ImportedModel,
    config: Path | None,
    gripper: Path | None,
    arm: str | None,
    paths: tuple[Path, ...],
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        try:
            if config is None:
                found = infer(path, gripper=gripper, arm=arm, package_paths=paths)
                config = Path(folder) / f"{path.stem}.robosandbox.yaml"
                config.write_text(to_yaml(found), encoding="utf-8")
                given = found.sidecar
                with doing(f"comparing the sidecar with {path.name}"):
                    static = compare(found, given)
            else:
                given = load_yaml_model(config, Sidecar)
                with doing(f"comparing the sidecar with {path.name}"):
                    found, static = examine(imported, given, config, paths)
        except InputError as error:
            report.add([CheckResult("load", False, str(error), blamed_field(config, str(error)))])
            return
        report.sidecar = given.model_dump(mode="json", exclude_none=True)
        try:
            robot = load_robot(path, config, paths)
        except InputError as error:
            # What the comparison names is the cause; the loader saw its consequence.
            named = next((item.field for item in static if not item.ok and item.field), None)
            report.add([CheckResult("load", False, str(error), named or blamed_field(config, str(error))), *static])
            return
        report.loads = True
        report.add([CheckResult("load", True, _summary(robot)), *static])
        report.add(try_out(path, config, robot, tuple(report.checks), found.sidecar.arm.home_qpos))


def _summary(robot: RobotModel) -> str:
    repairs = f"; {len(robot.notes)} notes on the model" if robot.notes else ""
    return f"{len(robot.sidecar.arm.joints)} arm joints, {_hand(robot)}{repairs}"


def _hand(robot: RobotModel) -> str:
    if robot.gripper is None:
        return "no gripper"
    geometry = robot.gripper.geometry
    if geometry.cup is not None:
        return f"a suction cup of {geometry.cup * 1000:.0f} mm"
    return f"gripper opens to {geometry.max_aperture * 1000:.0f} mm"
