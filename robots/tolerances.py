"""Tolerances of robots: how exact a sidecar has to be, and what a model's own frames and servos forgive."""

from __future__ import annotations

from robosandbox.values import frozen


@frozen(kw_only=True)
class RobotTolerances:
    """What is forgiven of a sidecar and of a model.

    The TCP's are such that the sidecars of robots/known and of tests/test_arms.py pass and the symptoms of
    docs/bring_your_own_robot.md are told.

    Attributes:
        tcp_aside: Metres that a TCP may lie beside the point where the pads meet.
        tcp_beyond: Metres that it may lie beyond it.
        tip_slack: Metres that it may lie beyond the fingertips, where these reach farther.
        tcp_behind: Metres that it may lie behind it.
        tcp_doubted: Metres behind it from which it is the first to be doubted where the trial fails.
        tcp_of_lip: Metres that it may lie before or behind a cup's lip: the height of a thin cup.
        tcp_of_link: Metres from the end of a last link without a gripper: as long as a tool that may be screwed on.
        approach_deg: Degrees between the given and the measured approach that a grasp from above forgives.
        outside: Share of the measured travel by which open and closed may lie outside of it.
        not_closed: Share of it from which closed is not closed; grippers that open half-way on purpose pass.
        not_open: Share of it up to which open is not open.
        sunk: Metres of a base under the table from which home and reach are not judged as well.
        along: Cosine to a link's own direction from which a frame or a face points along it: 45 degrees.
        stuck: Radians of error at which friction may hold a servo or a coupled joint: three degrees.
        sweep_seconds: Simulated seconds in which a gripper is swept from one end to the other: real ones close in about one.
    """

    tcp_aside: float = 0.010
    tcp_beyond: float = 0.012
    tip_slack: float = 0.003
    tcp_behind: float = 0.045
    tcp_doubted: float = 0.015
    tcp_of_lip: float = 0.005
    tcp_of_link: float = 0.15
    approach_deg: float = 20.0
    outside: float = 0.2
    not_closed: float = 0.3
    not_open: float = 0.7
    sunk: float = 0.06
    along: float = 0.7
    stuck: float = 0.05
    sweep_seconds: float = 1.5


ROBOT_TOLERANCES = RobotTolerances()
"""Tolerances of every robot."""
