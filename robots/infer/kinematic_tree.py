"""Kinematic tree of a robot, split into an arm and the gripper at its end."""

from __future__ import annotations

import re

import mujoco
import numpy as np

from robosandbox.robots.importers.servos import joint_bounds, model_joint_is_single
from robosandbox.values import frozen

_HINT = re.compile(r"grip|jaw|finger|claw|pinch|knuckle|driver|thumb|hand_?joint", re.IGNORECASE)
_WRIST = re.compile(r"roll|pitch|yaw|wrist|rotat|swivel|flex", re.IGNORECASE)
# A finger of a hand, whose tendons are drawn as joints, has up to nine; what tells it from an arm is its length.
# Number of links in a row up to which a branch may be a finger. Chosen.
_FINGER_DEPTH = 10
# Metres from its first joint within which a finger ends. Chosen longer than a hand and shorter than the forearm of a small arm.
_FINGER_SPAN = 0.25
# Number of joints that an arm has at least, because with fewer it reaches points of a surface alone.
_LEAST_ARM = 3
# Travel of a slide, metres, beyond which it stands for wheels. Chosen longer than rails on which arms are mounted.
_LONGEST_RAIL = 5.0
# Metres between a jaw that has closed and its counterpart. Chosen so that a jaw modelled with a gap counts as closed.
_MEETS = 0.012
_HINGE = mujoco.mjtJoint.mjJNT_HINGE.value
_PARTS = 0.015  # Metres by which it opens more than that. Chosen.


@frozen
class Chain:
    """An arm in a tree, by ids of the model that it was found in.

    Attributes:
        joints: Arm joints, base to wrist.
        palm: The body that carries the fingers, or the last link of an arm without a gripper.
        gripper_joints: All joints beyond the palm; empty without a gripper.
        gripper_actuators: What drives them.
        evidence: Why these, in words.
        confidence: 0..1.
    """

    joints: tuple[int, ...]
    palm: int
    gripper_joints: tuple[int, ...]
    gripper_actuators: tuple[int, ...]
    evidence: str
    confidence: float

    def name(self, model: mujoco.MjModel) -> str:
        """Return what to call it: the palm's body."""
        return str(model.body(self.palm).name)


def find_chains(model: mujoco.MjModel) -> list[Chain]:
    """Return the arms of a model, the likeliest first; empty when nothing has three joints in a row."""
    tree = _KinematicTree(model)
    chains = []
    for end in tree.ends():
        chain = _chain_to(model, tree, end)
        if chain is not None:
            chains.append(chain)
    shared: dict[int, int] = {}
    for chain in chains:
        for joint in chain.joints:
            shared[joint] = shared.get(joint, 0) + 1
    alone = []
    for chain in chains:
        own = tuple(joint for joint in chain.joints if shared[joint] == 1)
        if len(own) >= _LEAST_ARM:
            alone.append(
                Chain(own, chain.palm, chain.gripper_joints, chain.gripper_actuators, chain.evidence, chain.confidence)
            )
    if not alone and chains:
        alone = [max(chains, key=lambda chain: len(chain.joints))]
    # A gripper first, then as many joints as an arm has, then the file's order.
    return sorted(alone, key=lambda chain: (not chain.gripper_joints, -min(len(chain.joints), 7)))


class _KinematicTree:
    """Bodies welded together as one node, joined by hinges and slides."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.weld = model.body_weldid
        self.children: dict[int, list[int]] = {}
        self.parent: dict[int, int] = {}
        for body in range(1, model.nbody):
            if int(self.weld[body]) == body and model.body_jntnum[body]:
                above = int(self.weld[model.body_parentid[body]])
                self.children.setdefault(above, []).append(body)
                self.parent[body] = above
        self.driven = _driven(model)
        self.data = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, self.data)

    def joints_of(self, node: int) -> list[int]:
        first, count = int(self.model.body_jntadr[node]), int(self.model.body_jntnum[node])
        return [j for j in range(first, first + count) if model_joint_is_single(self.model, j)]

    def below(self, node: int) -> list[int]:
        """Return the nodes below, `node` left out."""
        found, pending = [], list(self.children.get(node, ()))
        while pending:
            at = pending.pop(0)
            found.append(at)
            pending += self.children.get(at, ())
        return found

    def depth(self, node: int) -> int:
        return 1 + max((self.depth(child) for child in self.children.get(node, ())), default=0)

    def span(self, node: int) -> float:
        """Return how far geoms below a node's joint reach from it, metres."""
        nodes = {node, *self.below(node)}
        model = self.model
        geoms = [g for g in range(model.ngeom) if int(self.weld[model.geom_bodyid[g]]) in nodes]
        origin = self.data.xpos[node]
        reaches = [float(np.linalg.norm(self.data.geom_xpos[g] - origin)) + model.geom_rbound[g] for g in geoms]
        return max(reaches, default=0.0)

    def is_finger(self, node: int) -> bool:
        return self.depth(node) <= _FINGER_DEPTH and self.span(node) < _FINGER_SPAN

    def spins(self, node: int) -> bool:
        """Tell whether a node turns on a hinge without end and closes on nothing, as a propeller does that shows a motor."""
        free = [not self.model.jnt_limited[j] and self.model.jnt_type[j] == _HINGE for j in self.joints_of(node)]
        return free == [True] and not self.children.get(node)

    def is_active(self, node: int) -> bool:
        return any(j in self.driven for n in (node, *self.below(node)) for j in self.joints_of(n))

    def ends(self) -> list[int]:
        """Return the nodes at which an arm may end: where only fingers follow, or nothing does."""
        return [node for node in self.parent if self._may_end(node) and not self._inside_hand(node)]

    def _may_end(self, node: int) -> bool:
        """Tell whether nothing follows on a node, or only the fingers of a hand."""
        children = self.children.get(node, [])
        return not children or (len(children) > 1 and all(self.is_finger(n) for n in children))

    def _inside_hand(self, node: int) -> bool:
        """Tell whether a node is itself part of a finger of some palm above."""
        walk = node
        while walk in self.parent:
            above = self.parent[walk]
            siblings = self.children[above]
            if above and len(siblings) > 1 and all(self.is_finger(n) for n in siblings):
                return True
            walk = above
        return False


def _driven(model: mujoco.MjModel) -> dict[int, list[int]]:
    """Return joint -> actuators that pull it, directly or over a tendon."""
    pairs = [(joint, actuator) for actuator in range(model.nu) for joint in actuator_joints(model, actuator)]
    return {joint: [a for j, a in pairs if j == joint] for joint, _ in pairs}


def actuator_joints(model: mujoco.MjModel, actuator: int) -> list[int]:
    """Return the joints that an actuator drives."""
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    if kind == mujoco.mjtTrn.mjTRN_JOINT.value:
        return [target]
    return tendon_joints(model, target) if kind == mujoco.mjtTrn.mjTRN_TENDON.value else []


def tendon_joints(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Return the joints that a tendon is a sum of."""
    start, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    wraps = range(start, start + count)
    return [int(model.wrap_objid[w]) for w in wraps if model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT.value]


@frozen
class _Ending:
    """End of a chain from the base: the nodes of the arm, the palm, the nodes of the hand, and why these."""

    path: list[int]
    palm: int
    hand: list[int]
    evidence: str
    confidence: float


def _ending(model: mujoco.MjModel, tree: _KinematicTree, end: int) -> _Ending:
    path = [end]
    while tree.parent.get(path[-1], 0):
        path.append(tree.parent[path[-1]])
    path.reverse()
    branches = tree.children.get(end, [])
    if branches:
        fingers = [node for node in branches if not tree.spins(node)] or branches
        hand = [below for node in fingers for below in (node, *tree.below(node))]
        return _Ending(path, end, hand, f"{len(fingers)} short branches on one body", 0.95)
    why = _why_jaw(model, tree, end) if len(path) > _LEAST_ARM else None
    if why is not None:
        return _Ending(path[:-1], tree.parent[end], [end], why, 0.9)
    return _Ending(path, end, [], "no joint beyond the last link closes on anything: no gripper", 0.9)


def _chain_to(model: mujoco.MjModel, tree: _KinematicTree, end: int) -> Chain | None:
    ending = _ending(model, tree, end)
    driving = _driving_base(model, tree, ending.path)
    arm = [j for node in ending.path for j in tree.joints_of(node) if j in tree.driven and j not in driving]
    arm = _without_torso(tree, ending.path, arm)
    if len(arm) < _LEAST_ARM:
        return None
    joints = tuple(j for node in ending.hand for j in tree.joints_of(node))
    actuators = tuple(sorted({a for j in joints for a in tree.driven.get(j, ())}))
    palm, evidence = _palm_body(model, ending.palm, ending.hand), ending.evidence
    if ending.hand and not actuators:
        joints, evidence = (), "the joints beyond the last link have no actuator"
    return Chain(tuple(arm), palm, joints, actuators, evidence, ending.confidence)


def _without_torso(tree: _KinematicTree, path: list[int], arm: list[int]) -> list[int]:
    """Return the joints that carry nothing but this arm: a torso with a head and a base with wheels are held."""
    for k, node in enumerate(path):
        above = tree.parent.get(node, 0)
        if not above:
            continue
        others = [n for n in tree.children[above] if n != node and tree.is_active(n) and tree.depth(n) > 1]
        held = {j for n in path[:k] for j in tree.joints_of(n)}
        rest = [j for j in arm if j not in held]
        if others and len(rest) >= _LEAST_ARM:
            arm = rest
    return arm


def _driving_base(model: mujoco.MjModel, tree: _KinematicTree, path: list[int]) -> set[int]:
    """Return the joints at the root that stand for wheels: slides over the floor farther than any rail, and the turn on them."""
    joints = [j for node in path for j in tree.joints_of(node)]
    slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE.value
    travel = np.where(model.jnt_limited.astype(bool), np.ptp(model.jnt_range, axis=1), np.inf)
    last = max((k for k, j in enumerate(joints) if slides[j] and travel[j] > _LONGEST_RAIL), default=-1)
    if last < 0:
        return set()
    after = joints[last + 1] if last + 1 < len(joints) else -1
    if after >= 0 and not slides[after] and travel[after] > 2.0 * np.pi - 0.1 and abs(tree.data.xaxis[after, 2]) > 0.9:
        last += 1
    return set(joints[: last + 1])


def _palm_body(model: mujoco.MjModel, palm: int, hand: list[int]) -> int:
    """Return the body that the fingers hang on; without fingers the outermost one welded to the last link."""
    parents = {
        int(model.body_parentid[node]) for node in hand if int(model.body_weldid[model.body_parentid[node]]) == palm
    }
    if parents:
        return min(parents)
    welded = [b for b in range(palm, model.nbody) if int(model.body_weldid[b]) == palm]
    with_shape = [b for b in welded if model.body_geomnum[b]]
    return with_shape[-1] if with_shape else palm


def _why_jaw(model: mujoco.MjModel, tree: _KinematicTree, node: int) -> str | None:
    """Say why a last joint closes its link against the one before it, as a jaw does; None where it does not."""
    joints = tree.joints_of(node)
    if len(joints) != 1:
        return None
    joint, parent = joints[0], tree.parent.get(node, 0)
    hinted = _hinted(str(model.joint(joint).name), str(model.body(node).name))
    if hinted is None:
        return None
    mine, other = _geoms(model, tree, node), _geoms(model, tree, parent)
    if not mine or not other:
        return f"{hinted!r} by its name" if hinted else None
    gaps = _swept_gaps(model, joint, mine, other)
    closes = min(gaps) < _MEETS and max(gaps) > min(gaps) + _PARTS
    if hinted and (closes or not _WRIST.search(hinted)):
        return f"{hinted!r} by its name" + (", and it closes on the link before it" if closes else "")
    fixed = (
        closes and _closes_at_an_end(gaps) and model.body_weldid[parent] and _stands_beside(model, tree, node, joint)
    )
    return "the last link closes on a fixed jaw of the one before it" if fixed else None


def _hinted(joint: str, body: str) -> str | None:
    """Return the name that speaks of a gripper, "" where neither does; None where the joint is called a wrist's."""
    hinted = next((name for name in (joint, body) if _HINT.search(name)), "")
    return None if _WRIST.search(joint) and hinted != joint else hinted


def _closes_at_an_end(gaps: list[float]) -> bool:
    """Tell whether the gap is least at one end of the range: a wrist folds back on its forearm on the way through a wide one."""
    least = min(gaps)
    return gaps.index(least) in (0, len(gaps) - 1) and float(np.median(gaps)) > least + _PARTS / 3.0


def _swept_gaps(model: mujoco.MjModel, joint: int, mine: list[int], other: list[int]) -> list[float]:
    """Return the distance from a link's far end to the link before it at places over the joint's range, metres."""
    low, high = (float(bound[joint]) for bound in joint_bounds(model))
    data = mujoco.MjData(model)
    address = int(model.jnt_qposadr[joint])
    gaps = []
    for value in np.linspace(low, high, 9):
        data.qpos[:] = model.qpos0
        data.qpos[address] = value
        mujoco.mj_fwdPosition(model, data)
        gaps.append(_far_gap(model, data, joint, mine, other))
    return gaps


def _geoms(model: mujoco.MjModel, tree: _KinematicTree, node: int) -> list[int]:
    all_of = [g for g in range(model.ngeom) if int(tree.weld[model.geom_bodyid[g]]) == node]
    solid = [g for g in all_of if model.geom_contype[g] or model.geom_conaffinity[g]]
    return solid or all_of


def _far_gap(model: mujoco.MjModel, data: mujoco.MjData, joint: int, mine: list[int], other: list[int]) -> float:
    """Return the distance from the moving link's far end to the fixed link, metres."""
    points = surface_points(model, data, mine)
    anchor, axis = data.xanchor[joint], data.xaxis[joint]
    lever = points - anchor
    if model.jnt_type[joint] == _HINGE:
        lever = lever - np.outer(lever @ axis, axis)
    distance = np.linalg.norm(lever, axis=1)
    far = points[distance > 0.6 * distance.max()]
    fixed = surface_points(model, data, other)
    far = far[:: max(1, len(far) // 200)]
    fixed = fixed[:: max(1, len(fixed) // 1500)]
    return float(np.linalg.norm(far[:, None] - fixed[None], axis=2).min())


def _stands_beside(model: mujoco.MjModel, tree: _KinematicTree, node: int, joint: int) -> bool:
    """Tell whether the fixed link reaches about as far beyond the joint as the moving one."""
    data = tree.data
    anchor = data.xanchor[joint]
    moving = surface_points(model, data, _geoms(model, tree, node)) - anchor
    fixed = surface_points(model, data, _geoms(model, tree, tree.parent[node])) - anchor
    far = moving[np.linalg.norm(moving, axis=1).argmax()]
    ahead = far / np.linalg.norm(far)
    return bool((fixed @ ahead).max() > 0.6 * np.linalg.norm(far))


def surface_points(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> np.ndarray:
    """Return points on geoms in the world, (k, 3), metres: a mesh's vertices, the corners of anything else's box."""
    found = []
    for g in geoms:
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH.value:
            mesh = int(model.geom_dataid[g])
            start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            local = model.mesh_vert[start : start + count].astype(float)
        else:
            grid = np.linspace(-1.0, 1.0, 5)
            signs = np.array([[x, y, z] for x in grid for y in grid for z in grid])
            local = model.geom_aabb[g, :3] + signs * model.geom_aabb[g, 3:]
        found.append(data.geom_xpos[g] + local @ data.geom_xmat[g].reshape(3, 3).T)
    return np.concatenate(found) if found else np.zeros((1, 3))
