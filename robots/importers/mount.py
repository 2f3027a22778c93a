"""A gripper of its own file on an arm: one robot, the gripper's names behind `gripper/`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from robosandbox.errors import InputError
from robosandbox.robots.importers.imported import ImportedModel, copy_options
from robosandbox.robots.importers.importing import import_model, let_mounted_touch
from robosandbox.robots.sidecar import GripperAttachment
from robosandbox.validation import did_you_mean

GRIPPER_PREFIX = "gripper/"


def mount(
    arm: ImportedModel, attachment: GripperAttachment, model: Path, package_paths: Iterable[Path] = ()
) -> ImportedModel:
    """Attach a gripper to an arm, in place.

    Args:
        arm: The arm; it is changed.
        attachment: Where on it.
        model: The gripper's file, resolved.
        package_paths: Where package:// names are looked up.

    Raises:
        InputError: A file is wrong, or the body or site is not there.
    """
    gripper = import_model(model, package_paths, as_in_file=arm.options is not None)
    spec = arm.spec
    copy_options(gripper.spec, spec)
    x, y, z, w = attachment.quat_xyzw
    if attachment.to_site is not None:
        site = spec.site(attachment.to_site)
        if site is None:
            names = [item.name for item in spec.sites if item.name]
            raise InputError(
                f"gripper.attach.to_site {attachment.to_site!r} is not a site of {arm.path.name}"
                f"{did_you_mean(attachment.to_site, names)}"
            )
        # The offset is the site's to give; a site of its own keeps the arm's where it was.
        body = site.parent
        frame = body.add_frame(pos=site.pos, quat=list(site.quat))
        inner = body.add_frame(pos=attachment.xyz, quat=[w, x, y, z])
        inner.set_frame(frame)
        spec.attach(gripper.spec, prefix=GRIPPER_PREFIX, frame=inner)
    else:
        body = spec.body(str(attachment.to_body))
        if body is None:
            names = [item.name for item in spec.bodies if item.name != "world"]
            raise InputError(
                f"gripper.attach.to_body {attachment.to_body!r} is not a body of {arm.path.name}"
                f"{did_you_mean(str(attachment.to_body), names)}"
            )
        frame = body.add_frame(pos=attachment.xyz, quat=[w, x, y, z])
        spec.attach(gripper.spec, prefix=GRIPPER_PREFIX, frame=frame)
    arm.made_actuators |= {GRIPPER_PREFIX + name for name in gripper.made_actuators}
    arm.notes += [f"gripper: {note}" for note in gripper.notes]
    if arm.options is None:
        let_mounted_touch(arm, GRIPPER_PREFIX)
    return arm
