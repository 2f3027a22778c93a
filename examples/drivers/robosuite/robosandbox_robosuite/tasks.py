"""robosuite's one-arm tasks, which have no sentences, as goals and calls.

A line without "=" is a goal in relations, one with it a call. Things and parts are those that the importer finds; {object} is the
thing that a start has chosen, {place} where robosuite wants it. Nothing here knows a start or a seed.
"""

from __future__ import annotations

# Compartments of the second bin, as robosuite's judge has them.
PLACES = {
    "Milk": "bin2.compartment_3",
    "Bread": "bin2.compartment_4",
    "Cereal": "bin2.compartment_1",
    "Can": "bin2.compartment_2",
    "SquareNut": "peg1",
    "RoundNut": "peg2",
}
TASKS: dict[str, tuple[str, ...]] = {
    "Lift": ("holding(cube)",),
    "Stack": ("on(cubeA, cubeB)",),
    "PickPlace": tuple(f"inside({name}, {PLACES[name]})" for name in ("Milk", "Bread", "Cereal", "Can")),
    "PickPlaceSingle": ("inside({object}, {place})",),
    "PickPlaceMilk": ("inside({object}, {place})",),
    "PickPlaceBread": ("inside({object}, {place})",),
    "PickPlaceCereal": ("inside({object}, {place})",),
    "PickPlaceCan": ("inside({object}, {place})",),
    "NutAssembly": tuple(f"around({name}, {PLACES[name]})" for name in ("SquareNut", "RoundNut")),
    "NutAssemblySingle": ("around({object}, {place})",),
    "NutAssemblySquare": ("around({object}, {place})",),
    "NutAssemblyRound": ("around({object}, {place})",),
    "Door": ("open(Door.door)",),
    # No relation is of a table that is wiped, and no skill rubs.
    "Wipe": (),
    "ToolHang": ("inside(frame_root, stand_root)", "around(tool_root, frame_root)"),
}
