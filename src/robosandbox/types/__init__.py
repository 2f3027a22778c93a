"""The values that all parts share: poses, scenes, observations, trajectories, grasps, plans, the simulated state.

A value is one class in memory, in messages and in files, and its schema comes from the class. What people write (scenes, skill
arguments) is a strict, frozen pydantic model; what the robot makes is a frozen dataclass with read-only arrays. SI units and
radians; poses are in the world frame unless their name says otherwise.
"""

from robosandbox.spatial import (
    DIRECTION_AXES,
    SIDE_AXES,
    Array,
    Direction,
    Finite,
    Fraction,
    NonNegative,
    Pose,
    Positive,
    QuatXyzw,
    Side,
    StrictModel,
    Vec3,
    cross,
    frozen_array,
    matrix_about_axis,
    matrix_from_quat_xyzw,
    matrix_from_rotation_vector,
    quat_xyzw_from_matrix,
)
from robosandbox.types.checkpoint import Checkpoint
from robosandbox.types.limits import MAX_FORCE_N, MAX_UNINTENDED_FORCE_N, Limits, Workspace, force_limits
from robosandbox.types.motion import Grasp, GraspSearch, Intent, Trajectory
from robosandbox.types.objects import IDENTIFIER, MAX_BEADS, ObjectKind, Randomize, SceneObject
from robosandbox.types.plan import MAX_PROMPT_LENGTH, Plan, Refusal, RefusalCode, SkillCall, SkillResult
from robosandbox.types.scene import TABLE_HEIGHT, Scene
from robosandbox.types.sensed import (
    DetectedObject,
    GripperState,
    Intrinsics,
    Observation,
    ObservedScene,
    PictureWindow,
    RgbdFrame,
)
from robosandbox.types.tempo import CAREFUL, DEFAULT_TEMPO, TEMPOS, Speed, Tempo, Timing, find_tempo, share_of
from robosandbox.types.truth import Convex, ObjectTruth, Touch, Truth, Verdict

__all__ = [
    "CAREFUL",
    "DEFAULT_TEMPO",
    "DIRECTION_AXES",
    "IDENTIFIER",
    "MAX_BEADS",
    "MAX_FORCE_N",
    "MAX_PROMPT_LENGTH",
    "MAX_UNINTENDED_FORCE_N",
    "SIDE_AXES",
    "TABLE_HEIGHT",
    "TEMPOS",
    "Array",
    "Checkpoint",
    "Convex",
    "DetectedObject",
    "Direction",
    "Finite",
    "Fraction",
    "Grasp",
    "GraspSearch",
    "GripperState",
    "Intent",
    "Intrinsics",
    "Limits",
    "NonNegative",
    "ObjectKind",
    "ObjectTruth",
    "Observation",
    "ObservedScene",
    "PictureWindow",
    "Plan",
    "Pose",
    "Positive",
    "QuatXyzw",
    "Randomize",
    "Refusal",
    "RefusalCode",
    "RgbdFrame",
    "Scene",
    "SceneObject",
    "Side",
    "SkillCall",
    "SkillResult",
    "Speed",
    "StrictModel",
    "Tempo",
    "Timing",
    "Touch",
    "Trajectory",
    "Truth",
    "Vec3",
    "Verdict",
    "Workspace",
    "cross",
    "find_tempo",
    "force_limits",
    "frozen_array",
    "matrix_about_axis",
    "matrix_from_quat_xyzw",
    "matrix_from_rotation_vector",
    "quat_xyzw_from_matrix",
    "share_of",
]
