"""The words for places: directions, prepositions, the table, home, and orders in space.

Each table maps what people say to one canonical value. Multi-word entries are matched whole.
"""

from __future__ import annotations

DIRECTIONS: dict[str, str] = {
    "forward": (
        "forward, forwards, ahead, straight ahead, straight forward, onward, onwards, away from you, "
        "away from yourself, "
        "away from the robot, away from the arm, away from your base, away from the base, farther away, "
        "further away, "
        "to the front, frontward, frontwards, in the forward direction, in a forward direction, "
        "in the +x direction, outward, outwards, "
        "further from you, farther from you, out in front, further forward, along x, along +x"
    ),
    "back": (
        "nearer, closer, to you, to yourself, over to you, over to yourself, back to you, back to yourself, back, backward, backwards, rearward, rearwards, towards you, toward you, towards yourself, toward yourself, "
        "towards the robot, toward the robot, towards your base, toward your base, to the back, "
        "in the backward direction, "
        "towards the arm, toward the arm, closer to you, closer to yourself, closer to the robot, nearer to you, "
        "nearer to yourself, "
        "towards the base, to the rear, towards the robot arm, back towards you, back toward you, "
        "back towards yourself, "
        "towards the robot base, in your direction, closer to the base, nearer the robot, nearer to the robot"
    ),
    "left": (
        "direction left, in direction left, left direction, in left direction, more left, more to the left, left, leftward, leftwards, to the left, to your left, to left, towards the left, toward the left, "
        "over to the left, "
        "off to the left, on your left, toward your left, towards your left, "
        "in the left direction, further left, sideways to the left, to its left, left wards, along +y, "
        "in the leftward direction, more to the left, "
        "to the robot left, further to the left, over to your left, leftways"
    ),
    "right": (
        "direction right, in direction right, right direction, in right direction, more right, more to the right, right, rightward, rightwards, to the right, to your right, to right, towards the right, toward the right, "
        "over to the right, "
        "off to the right, on your right, toward your right, towards your right, "
        "further right, sideways to the right, to its right, right wards, along -y, in the rightward direction, "
        "more to the right, "
        "to the robot right, further to the right, over to your right, rightways"
    ),
}


def _axes(axis: str, sign: str) -> str:
    signed = (sign, f"the {sign}") if sign else ("", "the", "positive", "the positive", "plus")
    return "".join(
        f", {lead} {s} {axis}{tail}".replace("  ", " ")
        for lead in ("in", "along", "in direction", "towards", "on")
        for s in signed
        for tail in ("", " direction", " axis")
    ) + "".join(f", {s} {axis}{tail}" for s in (sign or "positive",) for tail in ("", " direction"))


for _name, _axis, _sign in (
    ("forward", "x", ""),
    ("back", "x", "negative"),
    ("left", "y", ""),
    ("right", "y", "negative"),
):
    DIRECTIONS[_name] += _axes(_axis, _sign) + (_axes(_axis, "minus") if _sign else "")
PARTICLES = (
    "into a tower, into one tower, into a stack, into one stack, in one stack, in a stack, in a tower, in one tower, in a pile, into a pile, into one pile, in one pile, as a tower, as a stack, into a single stack, into a single tower, in a single stack, into one big tower, into one big stack, into one tall tower, places, positions, spots, locations, places with each other, out of my way, out of our way, out of my way, out of our way, out of the road, up, down, off, out, away, over, together, apart, aside, open, closed, shut, to one side, out of the way, "
    "to the side, "
    "in the air, into the air, up in the air, up into the air, off the table, up off the table, up from the table, "
    "off of the table, off the ground, from the ground, off the desk, off the surface, around, round, over here, "
    "into your gripper, in your gripper, into the gripper, with one another, with each other, "
    "upward, upwards, back up, for me, each other, one another, in your hand, into your hand, off the tabletop, from the tabletop, "
    "off of the desk, off to one side, off to the side, in your grip, in your claw, on its own, by itself, "
    "back down, "
    "up high, in your grasp, on top of each other, on top of one another, on each other, on one another, "
    "next to each other, beside each other, side by side, next to one another, beside one another, "
    "in a row, in a line, in line, into a row, into a line, in one row, in a straight line, in one line, "
    "in a neat row, in a neat line, "
    "on top of it all, on top of the other, one on top of the other, one on another, over to one side"
)
RELATIONS: dict[str, str] = {
    "on": (
        "at the top of, at top of, on, on top of, atop, upon, on the top of, over, above, on top, overtop, over the top of, "
        "on the surface of, up on"
    ),
    "in": "in, inside, inside of, within, down in, inside the",
    "left": (
        "left of, to the left of, on the left of, on the left side of, to the left side of, at the left of, "
        "at left of, at the left of, at left side of, on left side of, in the left of, on left of, to left of, to left side of, left side of, on the left hand side of, to the left hand side of, at the left side of, just left of, "
        "just to the left of, immediately left of, immediately to the left of, "
        "on the lefthand side of, to the left from, directly left of, directly to the left of, "
        "over to the left of, off to the left of, left from"
    ),
    "right": (
        "right of, to the right of, on the right of, on the right side of, to the right side of, at the right of, "
        "at right of, at the right of, at right side of, on right side of, in the right of, on right of, to right of, to right side of, right side of, on the right hand side of, to the right hand side of, at the right side of, just right of, "
        "just to the right of, immediately right of, immediately to the right of, "
        "on the righthand side of, to the right from, directly right of, directly to the right of, "
        "over to the right of, off to the right of, right from"
    ),
    "front": (
        "in front of, in the front of, to the front of, at the front of, just in front of, right in front of, "
        "directly in front of, on the near side of, on this side of"
    ),
    "back": (
        "behind, in back of, at the back of, to the rear of, to the back of, just behind, right behind, "
        "directly behind, at the rear of, beyond, on the far side of"
    ),
    "opposite": "on the other side of, to the other side of, at the other side of, on the opposite side of",
    "beside": (
        "as close as possible to, as near as possible to, as close to, right up to, next to, beside, by, near, nearby, near to, close to, alongside, adjacent to, right next to, "
        "at the side of, by the side of, "
        "to the side of, just next to, right beside, along side, side by side with, close by, right by, just beside, "
        "up next to, directly next to, in the vicinity of, at, on the side of, touching, beside of, next of, aside of, besides of, near of, close of, right next of, just next of"
    ),
    "between": (
        "between, exactly between, right between, directly between, precisely between, somewhere between, right in between, right in the middle of, in between, in the middle of, midway between, halfway between, half way between, "
        "in the gap between, in the space between"
    ),
    "under": "under, underneath, below, beneath",
}
_CLOSER = [
    "straight",
    "directly",
    "right",
    "just",
    "immediately",
    "exactly",
    "precisely",
    "slightly",
    "somewhere",
    "anywhere",
]
for _kind, _plain in (
    ("left", "left of, to the left of, on the left of"),
    ("right", "right of, to the right of, on the right of"),
    ("front", "in front of"),
    ("back", "behind"),
    ("beside", "next to, beside, near, close to, by"),
    ("on", "on top of, on, above"),
    ("in", "in, inside"),
    ("between", "between, in between"),
):
    _known = {phrase.strip() for phrase in RELATIONS[_kind].split(",")}
    RELATIONS[_kind] += "".join(
        f", {closer} {phrase}"
        for closer in _CLOSER
        for phrase in _plain.split(", ")
        if f"{closer} {phrase}" not in _known and not (closer in ("right", "just") and phrase in ("on", "in", "by"))
    )
DIRECTIONAL: dict[str, str] = {
    "on": "onto, on to, onto the top of, onto top of, up onto, up on, down on, down onto",
    "in": "into, in to, down into, inside, to the inside of, over into, back into, back in, back inside",
    "to": "to, over to, up to, over by, across to",
    "towards": "towards, toward, in the direction of, closer to, nearer to, nearer, closer towards",
    "away": "away from, further from, farther from, further away from, farther away from",
    "against": "against, up against, until it touches, so that it touches, so it touches",
}
SOURCES = (
    "from under, from underneath, from beneath, from below, out from under, out from underneath, from, off, off of, out of, from off, from on top of, from inside, from off of, from within, out from, "
    "out from inside, up from, from on, from atop, from the top of, off the top of, from inside of"
)
TABLE = (
    "table, table top, tabletop, desk, desktop, surface, counter, countertop, workbench, bench, work surface, "
    "worktop, working surface, "
    "workspace, work area"
)
FLOOR = "floor, ground, carpet"
ROBOT = (
    "you, yourself, the robot, your base, the base, the arm, the robot arm, robot, the robot base, your arm, "
    "base of the robot"
)
ORDER_UP = (
    "from bottom to top, bottom to top, bottom up, from the bottom up, from the ground up, starting from the bottom, "
    "starting at the bottom, in that order from the bottom, from the bottom to the top, bottom first, "
    "starting with the bottom, from bottom up, going up, upwards, counting from the bottom, from the bottom"
)
ORDER_DOWN = (
    "from top to bottom, top to bottom, top down, from the top down, starting from the top, "
    "from the top to the bottom, top first, starting at the top, from top down, going down, downwards, "
    "from the top"
)
BY_COLOUR = (
    "by colour, by color, by their colour, by their color, by colours, by colors, according to colour, "
    "according to color, according to their colour, according to their color, based on colour, based on color, "
    "based on their colour, based on their color, colour wise, color wise, per colour, per color, "
    "in terms of color, in terms of colour, colorwise, colourwise, by the color, by the colour, "
    "depending on colour, depending on color, depending on their color, depending on their colour, "
    "on the basis of color"
)
BY_SIZE = (
    "from biggest to smallest, from largest to smallest, biggest to smallest, largest to smallest, from big to small, from large to small, in order of size, in size order, biggest first, largest first, "
    "with the biggest at the bottom, from the biggest to the smallest, from the largest to the smallest, from widest to narrowest"
)
SMALL_FIRST = (
    "from smallest to biggest, from smallest to largest, smallest to biggest, smallest to largest, from small to big, "
    "from the smallest to the biggest, from the smallest to the largest"
)
BY_OTHER = (
    "by size, by shape, by type, by kind, by weight, by height, alphabetically, by their size, by their shape, "
    "according to size, according to shape, based on size, based on shape, by name, from smallest to largest, "
    "from largest to smallest, from small to large, from big to small"
)
MATCHING = (
    "matching, corresponding, same coloured, same colored, similarly colored, like colored, like coloured, "
    "appropriate, correct, respective, "
    "correctly colored, color matched, correctly coloured"
)
SAME_COLOUR = (
    "of their own colour, of their own color, of its own colour, of its own color, in their own colour, in their own color, in the same colour, in the same color, in its own colour, in its colour, in its color, in their colour, in their color, that is the same colour, that is the same color, that are the same colour, that are the same color, that have the same colour, that have the same color, with matching colors, with matching colours, of matching colors, of matching colours, with the same colours, with the same colors, "
    "of the same colour, of the same color, with the same colour, with the same color, of its colour, "
    "of its color, of their colour, of their color, that matches its colour, "
    "that matches its color, that matches, that match, of matching colour, of matching color, "
    "that matches their color, that matches their colour, with a matching color, with a matching colour, "
    "which matches its color, "
    "that has the same color, that has the same colour, that share its color, that shares its color, "
    "that shares its colour, with the matching color, that match their color, that match their colour, that match their colors, that match their colours, "
    "matching its color, matching their color, matching its colour, matching their colour"
)
MISMATCHED = "non matching, mismatched, differently coloured, differently colored, other coloured, other colored"
OTHER_COLOUR = "".join(
    f"{that} {not_} match{its}, "
    for that in ("that", "which")
    for not_ in ("does not", "do not")
    for its in (
        " its colour",
        " its color",
        " their colour",
        " their color",
        " their own colour",
        " their own color",
        "",
    )
) + "".join(
    f"{of} {other} {colour}, "
    for of in ("of", "with", "in", "that is", "that has", "which is", "which has")
    for other in ("the other", "a different", "another", "not its", "not its own")
    for colour in ("colour", "color")
).removesuffix(", ")
HOMES = (
    "home, home pos, home position, home pose, home configuration, start position, starting position, start pose, "
    "starting pose, start, rest position, resting position, rest pose, rest, initial position, "
    "initial pose, neutral position, neutral pose, default position, default pose, ready position, ready pose, "
    "original position, initial configuration, base position, idle position, parking position, "
    "beginning, starting point, starting place, home base, park position, neutral, home state, initial state, "
    "home location, base, safe position, zero position, zero pose, standby, starting configuration, "
    "default configuration, resting pose, start point"
)
ARM = (
    "arm, robot, gripper, hand, robot arm, manipulator, yourself, robotic arm, claw, end effector, effector, "
    "system, machine, fingers, position, pose"
)
ORIGINAL = "".join(
    f"{back}{to} {its} {old} {place}, "
    for back in ("", "back ")
    for to in ("in", "to", "into", "on", "onto", "at")
    for its in ("its", "their", "his", "her", "the")
    for old in ("same", "old", "original", "previous", "former", "earlier", "initial", "starting", "prior", "usual")
    for place in ("place", "spot", "position", "location", "home")
)
ORIGINAL += (
    "same place, same spot, same position, again same place, again in the same place, again at the same place, where it stood, back where it stood, where it sat, where it had been, back where it had been, back to where it stood, where it lay, back where it lay, back where it sat, to where it stood, exactly where it stood, back exactly where it was, back exactly where it stood, back exactly where you found it, back to exactly where it was, right back where it was, back where it was, back where you found it, where it was, where you found it, back to where it was, "
    "back in its place, back in place, back to its place, where it came from, back where it came from, "
    "back to its original position, back to its original place, to its original position, "
    "to its original place, in its original position, in its original place, to where it was, "
    "back to where you found it, "
    "back to where it came from, to where you found it, back to its starting position, "
    "back to its original location, back to its original spot, in its original spot, to its original spot, "
    "back in its original place, "
    "back in its original position, back in its original spot, where it was before, back where it was before, "
    "where you got it from, back where you got it, where you got it, back where you got it from, "
    "back to its spot, back in its spot, "
    "back where it started, where it started, where you picked it up from, where you took it from, "
    "to its starting position, to where it started, back to where it started, where it used to be, "
    "where it originally was, back where you picked it up, exactly where it was, back to where you got it"
)
TOPS = (
    "the highest, the top one, the uppermost, the uppermost one, highest, on top, on the top, at the top, top, up top, at top, uppermost, topmost, as the top, as the top one, "
    "last, on the very top, at the very top"
)
BOTTOMS = (
    "the lowest, the lowest one, the bottom one, the lowermost, below, beneath, at the bottom, on the bottom, bottom, on bottom, as the base, as a base, as the bottom, "
    "as the bottom one, as the foundation, at the base, at bottom, as its base, first, at the very bottom, "
    "on the very bottom, underneath, lowest"
)
FREE_SPOTS = (
    "somewhere free, anywhere free, some free spot, on some free spot, at some free spot, in some free spot, "
    "somewhere, anywhere, somewhere else, elsewhere, somewhere free, anywhere free, anywhere else, "
    "some place else, someplace else, in an empty spot, in a free spot, somewhere empty, on an empty spot, "
    "on a free spot, "
    "at a free spot, in a free space, in an empty space, to an empty spot, to a free spot, "
    "wherever there is space, wherever you like, wherever you want, anywhere you like, anywhere you want, "
    "wherever there is room, "
    "where there is space, where there is room, somewhere safe, in a clear spot, on an empty patch, "
    "to a free space, to an empty space, in the open, in an open spot, on a clear spot, in an empty area, "
    "to an empty area, where there is free space"
)
MIDDLES = "in the middle, in between, middle, in the centre, in the center, between them, in between them"
ITS_SIDES = {
    "left": "on its left, to its left, on its left side, to its left side, on its left hand side, at its left, on the left of it, left of it",
    "right": "on its right, to its right, on its right side, to its right side, on its right hand side, at its right, on the right of it, right of it",
}
OPPOSITES = {
    "left": "to the left, on the left, on the left side, to the left side, at the left, on the other side to the left",
    "right": "to the right, on the right, on the right side, to the right side, at the right",
    "front": "in front, in the front, at the front, on the front side",
    "back": "behind, at the back, in the back, behind it all, in back",
}
"""Sides of what was named before: "the red cube left of the bowl and the blue one to the right"."""
SO_THAT = (
    "so that it is, such that it is, so it is, so that it sits, so it sits, so that it ends up, so it ends up, such that it sits, so that it stands, "
    "so that they are, so they are, such that it ends up, so that it rests, such that it rests, so it will be, so that it will be"
)
