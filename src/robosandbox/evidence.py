"""Evidence of failures: the measurements, one model for each kind of error."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import ConfigDict, Field

from robosandbox.types import Pose, StrictModel


class Evidence(StrictModel):
    """Measurements that show why a skill failed; each error has its own kind."""

    def met(self) -> tuple[str, ...]:
        """Return the names of what touched or stood in the way."""
        return ()

    @property
    def is_final(self) -> bool:
        """True where the cause is the thing or the gripper itself, so that nothing that the robot does first can help."""
        return False


class ForeignEvidence(Evidence):
    """Measurements of a kind that is not installed here: fields as they came, readable by name."""

    model_config: ClassVar[ConfigDict] = ConfigDict(extra="allow")


class UnreachableEvidence(Evidence):
    """Distance that the best configuration leaves to the target.

    Attributes:
        target: The TCP pose asked for.
        position_error: Metres left.
        orientation_error: Radians left.
        joints_at_limits: Arm joints that stop it.
        nearest: The nearest reachable TCP pose found.
    """

    target: Pose
    position_error: float
    orientation_error: float
    joints_at_limits: tuple[str, ...] = ()
    nearest: Pose


class LimitEvidence(Evidence):
    """Quantity that would leave its limits.

    Attributes:
        quantity: What is limited, in words.
        value: What it is or would be, SI units.
        low: The least allowed.
        high: The most allowed.
        touching: What the robot presses on, where the quantity is a force.
    """

    quantity: str
    value: float
    low: float
    high: float
    touching: tuple[str, ...] = ()

    def met(self) -> tuple[str, ...]:
        """Return what the robot presses on."""
        return self.touching


class CollisionEvidence(Evidence):
    """Pair that touches or comes too near, its depth, and the place on the path.

    Attributes:
        body: The moving body (of the arm, or the held object).
        other: What it would touch.
        depth: Penetration, metres; negative where they would come nearer than the planner's clearance, and not touch there.
        waypoint: Index of the first colliding configuration.
        waypoints: How many the path has.
    """

    body: str
    other: str
    depth: float
    waypoint: int
    waypoints: int

    def met(self) -> tuple[str, ...]:
        """Return what would be touched, and what would touch it."""
        return (self.other, self.body)

    def told(self) -> str:
        """Return what the pair would come to, in words."""
        if self.depth < 0.0:
            return f"{self.body} would come within {-1e3 * self.depth:.1f} mm of {self.other}"
        return f"{self.body} would touch {self.other} ({1e3 * self.depth:.1f} mm deep)"


class GraspEvidence(Evidence):
    """State of the fingers after a grasp.

    Attributes:
        object: Id.
        reason: No candidate; closed on nothing; lost after closing; held, but fixed where it is or far too heavy
            ("immovable"); moved free of all else, but heavier than the grip or the arm can bear ("too_heavy"); under something
            ("caught"), between things or walls ("wedged"), or against one ("braced"); fingers that do not go where they
            are sent ("gripper_stuck"); a suction cup that does not lie on it all round ("no_seal").
        object_width: Extent between the fingers, metres; None when no candidate was found.
        aperture: The gap after closing, or the most it opens, metres.
        max_aperture: The most it opens, metres.
        commanded: The gap that was commanded, metres; None when it does not matter.
        pull: The largest upward force with which the arm pulled at it, N; None when it was not lifted.
        moved: How far it went while it was lifted, metres; None when it was not lifted.
        tried: How many candidates were examined, and what stopped each kind of them.
        touching: What holds it back, where it is caught, wedged or braced.
        seal: Radius about a suction cup's axis that lies on it, metres; None for fingers.
        needed_seal: The radius that is needed, metres.
    """

    object: str
    reason: Literal[
        "none_found",
        "missed",
        "slipped",
        "immovable",
        "too_heavy",
        "caught",
        "wedged",
        "braced",
        "gripper_stuck",
        "no_seal",
    ]
    object_width: float | None = None
    aperture: float
    max_aperture: float
    commanded: float | None = None
    pull: float | None = None
    moved: float | None = None
    tried: dict[str, int] = Field(default_factory=dict)
    touching: tuple[str, ...] = ()
    seal: float | None = None
    needed_seal: float | None = None

    def met(self) -> tuple[str, ...]:
        """Return what holds it back."""
        return self.touching

    @property
    def is_final(self) -> bool:
        """True where the object does not come, or the fingers do not go."""
        return self.reason in ("immovable", "too_heavy", "gripper_stuck")


class ObjectNotFoundEvidence(Evidence):
    """Query that fits nothing, and the objects that are there.

    Attributes:
        query: As it was asked.
        seen: Ids of all that is seen.
    """

    query: str
    seen: tuple[str, ...]


class HoldingEvidence(Evidence):
    """Object in the gripper, if any.

    Attributes:
        held: Id of the held object.
        aperture: The gap between the fingers, metres.
    """

    held: str | None
    aperture: float


class PlacementEvidence(Evidence):
    """Place where the object is in place of its target.

    Attributes:
        object: What was placed.
        target: Where it should be: an object id or "table".
        reason: No free spot, beside the mark, fallen over, not let go, no place for it, or a drawer that is closed.
        expected: The pose aimed at.
        actual: The pose seen afterwards; None when it was not let go.
        blocking: What occupies the place.
    """

    object: str
    target: str
    reason: Literal["occupied", "missed", "toppled", "stuck", "unsuitable", "closed"]
    expected: Pose | None = None
    actual: Pose | None = None
    blocking: tuple[str, ...] = ()

    def met(self) -> tuple[str, ...]:
        """Return what occupies the place."""
        return self.blocking


class DrawerEvidence(Evidence):
    """Distance that a drawer slid, and the force that it took.

    Attributes:
        drawer: Id.
        reason: It did not give way at all, stopped on the way, or the hand lost it.
        wanted: The opening asked for, metres.
        opening: The opening reached, metres.
        force: The most that the hand pulled or pushed with, along the way that the drawer slides, N.
        blocking: What touches the drawer's sliding box, besides the robot.
    """

    drawer: str
    reason: Literal["locked", "blocked", "slipped"]
    wanted: float
    opening: float
    force: float
    blocking: tuple[str, ...] = ()

    def met(self) -> tuple[str, ...]:
        """Return what touches the sliding box."""
        return self.blocking

    @property
    def is_final(self) -> bool:
        """True where the drawer does not give way at all."""
        return self.reason == "locked"


class PourEvidence(Evidence):
    """Places where the poured things are.

    Attributes:
        object: Id of the container that was poured from.
        target: Id of the container that was poured into.
        count: How many things were in it.
        poured: How many are in the target.
        spilled: How many are in neither.
    """

    object: str
    target: str
    count: int
    poured: int
    spilled: int


class TrackingEvidence(Evidence):
    """Joint that lags the most.

    Attributes:
        joint: Its name.
        error: Commanded minus actual, radians or metres.
        contacts: What the arm touches.
        servo_force: What the joint's servo gave, N m or N; None where a contact stopped the arm.
        servo_limit: The most that it can give.
        contact_force: With how many newtons the arm pressed on what stopped it; None where nothing did.
    """

    joint: str
    error: float
    contacts: tuple[str, ...] = ()
    servo_force: float | None = None
    servo_limit: float | None = None
    contact_force: float | None = None

    def met(self) -> tuple[str, ...]:
        """Return what the arm touches; each contact is written as "body on other"."""
        return tuple(pair.partition(" on ")[2] for pair in self.contacts)


class TimeoutEvidence(Evidence):
    """The deadline and the time spent.

    Attributes:
        deadline: Simulated seconds allowed.
        elapsed: Simulated seconds spent.
    """

    deadline: float
    elapsed: float


class BusyEvidence(Evidence):
    """Activity that keeps the robot busy.

    Attributes:
        doing: A skill's name, or "reset", "load" and the like.
        goal_id: The running goal; None when it is no goal.
        waiting: How many goals wait behind it.
    """

    doing: str
    goal_id: str | None = None
    waiting: int = 0


class MessageEvidence(Evidence):
    """Field of a message that is wrong.

    Attributes:
        field: Its path; empty for the whole message.
        problem: What is wrong with it.
    """

    field: str
    problem: str


class ConnectionEvidence(Evidence):
    """Robot whose connection was lost, and whether its sim has come back.

    Attributes:
        robot_id: The robot.
        restarted: Whether a new sim process serves it now; None when it is not known.
    """

    robot_id: str
    restarted: bool | None = None
