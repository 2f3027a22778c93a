"""Values of a robot: joints, limits, gripper, reach; without an index into anybody's model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robosandbox.spatial import Array
from robosandbox.types.limits import Limits
from robosandbox.types.outline import Outline
from robosandbox.types.scene import TABLE_HEIGHT
from robosandbox.values import frozen

# Joints that an arm takes for any pose of its hand.
FULL_POSE = 6
# Names of the only arm and of the only hand of a cell.
ARM, HAND = "arm", "hand"


def hand_of(arm: str) -> str:
    """Return the name of an arm's hand: of the only one "hand", of several that of the arm."""
    return HAND if arm == ARM else arm


# Share of a cup's radius about its axis that has to be covered for it to seal. Chosen as the half: what is held then hangs
# inside of what holds it, and a cup half over an edge, which leaks, covers none.
_SEALED = 0.5


@frozen(kw_only=True)
class GripperGeometry:
    """Geometry of a gripper from its model; lengths in metres, directions in the TCP frame (z approach, y closing).

    Of a suction cup the joint is its command, 0 off to 1 sucking, the TCP lies in the plane of its lip, and every gap is 0.

    Attributes:
        joint_samples: Primary joint values, increasing, shape (k,).
        aperture_samples: Gap between the pads at each, shape (k,).
        centre_samples: Where the middle of the gap lies at each, along the closing direction from the TCP, shape (k,): 0
            for fingers that meet in the middle, half the gap for a single moving jaw.
        control_samples: Actuator controls that hold each, shape (k, actuators).
        open_joint: The sidecar's open_qpos.
        closed_joint: The sidecar's closed_qpos.
        max_aperture: Gap at open.
        min_aperture: Gap at closed.
        tip_depth: How far the fingertips reach beyond the TCP along the approach.
        palm_depth: Free length between the fingers behind the TCP, up to the palm.
        finger_thickness: Of one finger along the closing direction, near its tip.
        finger_width: Of the pads across closing and approach.
        pads: Names of the two pad geoms or of their bodies, for messages.
        cup: Diameter of a suction cup's lip; None for fingers.
    """

    joint_samples: Array
    aperture_samples: Array
    centre_samples: Array
    control_samples: Array
    open_joint: float
    closed_joint: float
    max_aperture: float
    min_aperture: float
    tip_depth: float
    palm_depth: float
    finger_thickness: float
    finger_width: float
    pads: tuple[str, str]
    cup: float | None = None

    @property
    def seal(self) -> float:
        """Radius about a cup's axis that has to be covered for it to seal, metres; 0 for fingers."""
        return 0.0 if self.cup is None else _SEALED * self.cup / 2.0

    def aperture(self, joint: float) -> float:
        """Return the gap between the pads at a primary joint value."""
        return float(np.interp(joint, self.joint_samples, self.aperture_samples))

    def spread(self, joint: float) -> float:
        """Return how far the fingers are apart at a primary joint value, metres: the gap, which past its widest grows on at its mean rate.

        A jaw that swings leaves the closing line through the TCP, on which the gap is measured, long before it is open. What it holds
        nearer to its hinge, or at its tip, is less wide than this.
        """
        widest = self.joint_samples[self.aperture_samples > self.max_aperture - 1e-6].tolist()
        shut = max(map(self.closed_fraction, widest), default=0.0)
        rate = (self.max_aperture - self.min_aperture) / max(1.0 - shut, 1e-6)
        return self.aperture(joint) + rate * max(0.0, shut - self.closed_fraction(joint))

    def joint_for_aperture(self, aperture: float) -> float:
        """Return the primary joint value whose gap comes closest to `aperture`."""
        order = np.argsort(self.aperture_samples, kind="stable")
        return float(np.interp(aperture, self.aperture_samples[order], self.joint_samples[order]))

    def centre(self, aperture: float) -> float:
        """Return where along the closing direction, from the TCP, the middle of a gap of `aperture` lies, metres."""
        return float(np.interp(self.joint_for_aperture(aperture), self.joint_samples, self.centre_samples))

    def closed_fraction(self, joint: float) -> float:
        """Return 0 at open, 1 at closed, not clipped."""
        return (joint - self.open_joint) / (self.closed_joint - self.open_joint)

    def control(self, closed: float) -> Array:
        """Return the actuator controls, shape (actuators,), for a closed fraction in 0..1."""
        joint = self.open_joint + closed * (self.closed_joint - self.open_joint)
        return np.array([np.interp(joint, self.joint_samples, column) for column in self.control_samples.T])


@frozen(kw_only=True)
class GripperSpec:
    """A gripper.

    Attributes:
        geometry: What was derived of it.
        force_limits: Largest actuator force, shape (actuators,); infinite when the model sets none.
    """

    geometry: GripperGeometry
    force_limits: Array


@frozen(kw_only=True)
class RobotFiles:
    """The files of a robot whose sidecar somebody wrote for it.

    Attributes:
        model: The URDF or MJCF, resolved.
        sidecar: Resolved.
        package_paths: Where the model's package:// names are looked up.
        table_height: Of the table that it works on, metres.
    """

    model: Path
    sidecar: Path
    package_paths: tuple[Path, ...] = ()
    table_height: float = TABLE_HEIGHT


@frozen(kw_only=True)
class RobotSpec:
    """A robot. Arrays over arm joints have shape (n,), in sidecar order.

    Attributes:
        name: The model's stem.
        joints: Arm joint names as in the sidecar.
        lower: Joint limits; -inf where there is none.
        upper: Joint limits; inf where there is none.
        velocity_limits: rad/s or m/s.
        acceleration_limits: rad/s^2 or m/s^2.
        home_q: The sidecar's home.
        base_position: Its base in the world, shape (3,).
        gripper: None for an arm without one.
        reach: Least and largest horizontal distance from its first axis at which the tool points down at a table.
        tool_bounds: (x_min, x_max, y_min, y_max) of what is at the TCP, in its frame; of an arm without a gripper its last link.
        limits: The sidecar's; what nobody's plan may pass.
        files: Where it comes from, if it has a sidecar of its own; None for a bundled or an inferred one.
        outline: Points on its links; None where the joints do not tell where all of them are.
    """

    name: str
    joints: tuple[str, ...]
    lower: Array
    upper: Array
    velocity_limits: Array
    acceleration_limits: Array
    home_q: Array
    base_position: Array
    gripper: GripperSpec | None
    reach: tuple[float, float]
    tool_bounds: tuple[float, float, float, float] = (-0.01, 0.01, -0.01, 0.01)
    limits: Limits | None = None
    files: RobotFiles | None = None
    outline: Outline | None = None

    @property
    def n(self) -> int:
        """The number of arm joints."""
        return len(self.joints)

    @property
    def turns_freely(self) -> bool:
        """True for an arm with enough joints for every orientation of its hand."""
        return self.n >= FULL_POSE
