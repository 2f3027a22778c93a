"""Lint of a URDF: mistakes with file, element and value, told before anything is built from it."""

from __future__ import annotations

import math
from xml.etree import ElementTree

from robosandbox.errors import InputError
from robosandbox.validation import did_you_mean

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_NUMBERS: dict[tuple[str, str], tuple[int, ...]] = {
    ("origin", "xyz"): (3,),
    ("origin", "rpy"): (3,),
    ("axis", "xyz"): (3,),
    ("mass", "value"): (1,),
    **{("inertia", name): (1,) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")},
    **{("limit", name): (1,) for name in ("lower", "upper", "effort", "velocity")},
    **{("dynamics", name): (1,) for name in ("damping", "friction")},
    **{("mimic", name): (1,) for name in ("multiplier", "offset")},
    ("box", "size"): (3,),
    ("cylinder", "radius"): (1,),
    ("cylinder", "length"): (1,),
    ("capsule", "radius"): (1,),
    ("capsule", "length"): (1,),
    ("sphere", "radius"): (1,),
    ("mesh", "scale"): (1, 3),
    ("color", "rgba"): (4,),
}
_NEEDED: dict[str, tuple[str, ...]] = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
    "mesh": ("filename",),
    "mimic": ("joint",),
    "mass": ("value",),
}
_ROUND = ("cylinder", "capsule")
_POSITIVE = {
    ("box", "size"),
    ("sphere", "radius"),
    *((shape, name) for shape in _ROUND for name in ("radius", "length")),
}
# The largest length in metres or mass in kg. Chosen so that slips of a unit, as micrometres, are told.
_LARGEST = 1e6


def check_urdf(root: ElementTree.Element, source: str) -> None:
    """Check a parsed URDF.

    Raises:
        InputError: The first mistake: file, element, value, remedy.
    """
    if root.tag != "robot":
        raise InputError(
            f"{source}: the root element is <{str(root.tag).rpartition('}')[2][:40]}>; a URDF's is <robot>"
        )
    if any("xacro" in str(element.tag) for element in root.iter()):
        raise InputError(f"{source}: is a xacro; expand it first: xacro {source} > robot.urdf")
    links = _named(root, "link", source)
    joints = _named(root, "joint", source)
    if not links:
        raise InputError(f"{source}: has no <link>; a robot has at least one")
    for kind, elements in (("link", links), ("joint", joints)):
        for name, element in elements.items():
            _check_numbers(element, f"{source}: {kind} {name!r}")
    for name, joint in joints.items():
        _check_joint(joint, name, links, joints, source)
    _check_tree(links, joints, source)


def _named(root: ElementTree.Element, kind: str, source: str) -> dict[str, ElementTree.Element]:
    found: dict[str, ElementTree.Element] = {}
    for number, element in enumerate(root.findall(kind), start=1):
        name = element.get("name", "").strip()
        if not name:
            raise InputError(f"{source}: {kind} number {number} has no name; give each <{kind}> one")
        if name in found:
            raise InputError(f"{source}: {kind} {name!r} stands twice; names must be distinct")
        found[name] = element
    return found


def _check_numbers(element: ElementTree.Element, where: str) -> None:
    for child in element.iter():
        tag = str(child.tag)
        for attribute in _NEEDED.get(tag, ()):
            if child.get(attribute) is None:
                raise InputError(f"{where}: <{tag}> has no {attribute}; give it one")
        for attribute, text in child.attrib.items():
            counts = _NUMBERS.get((tag, attribute))
            if counts is None:
                continue
            values = numbers(text)
            if values is None or len(values) not in counts:
                takes = " or ".join(str(count) for count in counts)
                raise InputError(
                    f"{where}: <{tag} {attribute}={text[:40]!r}> takes {takes} finite number{'s' * (counts != (1,))}"
                )
            if (tag, attribute) in _POSITIVE and min(values) <= 0.0:
                raise InputError(f"{where}: <{tag} {attribute}={text[:40]!r}> must be greater than 0")
            if max(abs(value) for value in values) > _LARGEST and tag not in ("limit", "mesh"):
                raise InputError(f"{where}: <{tag} {attribute}={text[:40]!r}> is beyond any robot; use metres and kg")


def numbers(text: str) -> list[float] | None:
    """Return the finite numbers of an attribute, or None."""
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        return None
    return values if all(math.isfinite(value) for value in values) else None


def _check_joint(
    joint: ElementTree.Element,
    name: str,
    links: dict[str, ElementTree.Element],
    joints: dict[str, ElementTree.Element],
    source: str,
) -> None:
    where = f"{source}: joint {name!r}"
    kind = joint.get("type", "")
    if kind not in JOINT_TYPES:
        raise InputError(f"{where}: type {kind!r} is not one of {', '.join(JOINT_TYPES)}")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = "" if element is None else element.get("link", "")
        if link not in links:
            raise InputError(f"{where}: <{end} link={link!r}> is no link of the file{did_you_mean(link, links)}")
    if kind in ("revolute", "prismatic"):
        _check_limit(joint.find("limit"), kind, where)
    axis = joint.find("axis")
    if axis is not None and kind not in ("fixed", "floating"):
        values = numbers(axis.get("xyz", "1 0 0")) or [0.0]
        if sum(value * value for value in values) < 1e-12:
            raise InputError(f"{where}: <axis xyz={axis.get('xyz')!r}> has no direction; give a unit vector")
    _check_mimic(name, joints, where)


def _check_limit(limit: ElementTree.Element | None, kind: str, where: str) -> None:
    if limit is None:
        raise InputError(f"{where}: a {kind} joint takes <limit lower= upper= effort= velocity=>")
    lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
    if lower > upper:
        raise InputError(f"{where}: <limit> lower {lower:g} is above upper {upper:g}; swap them")


def _check_mimic(name: str, joints: dict[str, ElementTree.Element], where: str) -> None:
    """Follow a joint's mimic to the joint that leads them all."""
    seen = {name}
    while (mimic := joints[name].find("mimic")) is not None:
        followed = mimic.get("joint", "")
        if followed not in joints and len(seen) == 1:
            hint = did_you_mean(followed, joints)
            raise InputError(f"{where}: <mimic joint={followed!r}> is no joint of the file{hint}")
        if followed in seen:
            raise InputError(f"{where}: <mimic> leads in a circle over {followed!r}")
        if followed not in joints:
            # The joint that names it is told of.
            return
        seen.add(followed)
        name = followed


def _check_tree(links: dict[str, ElementTree.Element], joints: dict[str, ElementTree.Element], source: str) -> None:
    parent_of: dict[str, tuple[str, str]] = {}
    for name, joint in joints.items():
        parent, child = joint.find("parent"), joint.find("child")
        assert parent is not None and child is not None
        child_link = child.get("link", "")
        if child_link in parent_of:
            raise InputError(
                f"{source}: link {child_link!r} is the child of two joints, {parent_of[child_link][1]!r} and {name!r}; "
                "a URDF is a tree"
            )
        parent_of[child_link] = (parent.get("link", ""), name)
    roots = [name for name in links if name not in parent_of]
    if len(roots) != 1:
        found = ", ".join(repr(name) for name in roots[:5]) or "none, the joints form a circle"
        raise InputError(f"{source}: has {len(roots)} root links ({found}); join them by fixed joints to one tree")
    for name in links:
        seen = set()
        walk = name
        while walk in parent_of:
            if walk in seen:
                raise InputError(f"{source}: link {name!r} hangs in a circle of joints; a URDF is a tree")
            seen.add(walk)
            walk = parent_of[walk][0]
    depth = max(_depth(name, parent_of) for name in links)
    if depth > 200:
        raise InputError(f"{source}: its links form a chain {depth} long; a robot's is at most 200")


def _depth(name: str, parent_of: dict[str, tuple[str, str]]) -> int:
    depth = 0
    while name in parent_of:
        name, depth = parent_of[name][0], depth + 1
    return depth
