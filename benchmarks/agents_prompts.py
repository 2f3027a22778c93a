"""Thirty things said over bundled tasks, and what is acceptable for each in the notation of `sentences.py`."""

from __future__ import annotations

PROMPTS: tuple[tuple[str, str, str], ...] = (
    ("pick_cube_franka", "pick up the red cube", "pick(red_cube)"),
    ("pick_cube_franka", "fetch me the crimson block, would you", "pick(red_cube)"),
    ("pick_cube_franka", "pick up the elephant", "!object_not_found"),
    ("pick_cube_franka", "go home", "home()"),
    ("pick_cube_franka", "sing me a song", "!unsupported | !unrecognized"),
    ("pick_from_three", "pick up the green cube", "pick(green_cube)"),
    ("pick_from_three", "take whichever cube has the colour of grass", "pick(green_cube)"),
    ("pick_from_three", "pick up a cube", "pick(*) | !ambiguous"),
    ("pick_from_three", "lift it", "!ambiguous"),
    ("put_in_bin", "put the red cube in the bin", "pick(red_cube); place_in(grey_bin)"),
    ("put_in_bin", "tidy up", "pick(red_cube); place_in(grey_bin) | !ambiguous | !unsupported | !unrecognized"),
    ("put_in_bin", "do not touch anything", "!*"),
    ("put_in_bin", "the cube belongs in the bin", "pick(red_cube); place_in(grey_bin)"),
    ("stack_two", "stack the red cube on the blue cube", "stack(red_cube, blue_cube)"),
    ("stack_two", "the blue one wants to stand on top of the red one", "stack(blue_cube, red_cube)"),
    ("stack_two", "put the red cube on itself", "!*"),
    ("push_left", "push the red cube 10 cm to the left", "push(red_cube, left, 0.1)"),
    ("push_left", "give the cube a nudge away from you", "push(red_cube, forward, 0.005..0.3)"),
    ("open_drawer", "open the drawer", "open_drawer(drawer)"),
    ("open_drawer", "what is in the drawer?", "!*"),
    ("close_drawer", "shut the drawer, please", "close_drawer(drawer)"),
    (
        "put_in_drawer",
        "put the red cube in the drawer and close it",
        "open_drawer(drawer); pick(red_cube); place_in(drawer); close_drawer(drawer)",
    ),
    (
        "put_in_drawer",
        "put the can away, but leave the red cube alone",
        "open_drawer(drawer); pick(can); place_in(drawer)",
    ),
    (
        "place_beside",
        "put the red cube to the left of the blue block",
        "pick(red_cube); place_beside(blue_block, left)",
    ),
    ("place_on_block", "put the red cube on the blue block", "stack(red_cube, blue_block)"),
    ("tap_ball", "touch the ball", "tap(yellow_ball)"),
    ("tap_ball", "what is the weather like?", "!unsupported | !unrecognized"),
    ("tap_ball", "put the ball on the ceiling", "!*"),
    ("pour_beads", "pour the beads from the cup into the bowl", "pick(cup); pour(bowl)"),
    ("pour_beads", "throw the cup at the wall", "!unsupported | !unrecognized | !impossible"),
)
