"""Questions about ten scenes: answered from what is seen, and nothing moves."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import pytest

from robosandbox import open_session
from robosandbox.agent.language.answers import _Answers
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import ObservedScene, Plan, Pose, Refusal

QUESTIONS = {
    "pick_from_three": {
        "what's on the table?": "red_cube, green_cube and blue_cube are on the table",
        "how many cubes are there": "3: ",
        "where is the green cube?": "green_cube is on the table, at (0.20, 0.00) m",
        "are there any balls?": "No: I see no balls",
        "is there a red cube?": "Yes: red_cube",
        "which cube is the leftmost?": "blue_cube is a blue block",
        "what colour is the middle cube?": "green_cube is a green block",
        "which cube is in the middle?": "green_cube is a green block",
        "is the red cube closer to you than the green one?": "Yes: red_cube",
        "what is between the red and the blue cube?": "green_cube is between",
        "is the green cube between the other two?": "Yes: ",
        "is the red cube between the other two?": "No: ",
        "is the red cube closer to the green cube or to the blue cube?": "green_cube is nearer",
        "is the green cube closer to the red cube or the blue cube?": "Neither",
        "how far away from your base is the green cube?": "green_cube is 50 cm from the robot's base",
        "help": "My skills are ",
        "is the red cube bigger than the green cube?": "Neither",
        "how far apart are the red and the blue cube?": "32 cm apart",
        "is the green cube left of the red cube?": "Yes: green_cube is 16 cm to the left of red_cube",
        "is the green cube right of the red cube": "No: green_cube is 16 cm to the left of red_cube",
        "are you holding anything?": "I hold nothing",
        "what can you do?": "My skills are ",
        "how heavy is the red cube": None,
        "where is your hand?": "My hand is at (0.254, 0.000, 0.521) m, 48 cm above the table; I hold nothing",
        "how wide is your gripper open?": "There are 80 mm between my fingers",
        "how wide are you open?": "There are 80 mm between my fingers",
        "is the gripper closed?": "No: there are 80 mm between my fingers",
        "is your gripper open?": "Yes: there are 80 mm",
        "what are your joint angles?": "My joints are at 0.000, 0.000, 0.000, -1.571, 0.000, 1.571, -0.785",
        "are you moving?": "I stand still",
        "is the red cube in reach?": "Yes: red_cube",
        "which things can't you reach?": "Nothing is out of my reach.",
        "are the cubes all the same size?": "Yes: ",
        "there are three cubes, aren't there?": "Yes: ",
        "what did you just do?": "Nothing was done yet",
    },
    "put_in_drawer": {
        "is the drawer open?": "No: drawer is 0 mm open",
        "is the drawer closed": "Yes: drawer is 0 mm open",
        "what is in the drawer?": "Nothing is in drawer",
        "is the can standing up": "Yes: can is on the table",
        "is the can taller than the red cube?": "can is taller",
        "what's the smallest thing here?": "red_cube is a red block",
        "do you know where the can is?": "can is on the table",
        "is the can open?": "can neither opens nor closes",
    },
    "pour_beads": {
        "what's in the cup?": "30 beads are in cup",
        "how many beads are in the cup?": "30",
        "how full is the cup": "30 beads are in cup",
        "is there anything in the cup?": "Yes: beads",
        "how many things are on the table?": "2: cup and bowl",
        "is the bowl empty?": "Yes: Nothing is in bowl",
        "is the cup full?": "30 beads are in cup",
        "is the cup empty?": "No: 30 beads are in cup",
        "where are the beads?": "beads are 30 in cup",
        "which is bigger, the cup or the bowl?": "bowl is bigger",
        "how big is the bowl": "150 x 150 x 60 mm",
    },
    "sort_by_colour": {
        "how many red things are there?": "4: red_cube, red_can, red_ball and red_bin",
        "are there more cans than balls?": "Yes: 2 cans",
        "what is in the red bin?": "Nothing is in red_bin",
        "how many cubes are in the red bin": "None",
        "which cans are red?": "red_can is a red",
        "are both bins empty?": "Yes: Nothing is in red_bin. Nothing is in blue_bin.",
        "is one of the bins red?": "Yes: I see red_bin",
        "are the cans of the same colour?": "No: ",
        "what red things can you see?": "4: red_cube",
        "which bin is closest to the blue can?": "blue_bin is a blue bin",
        "is the red cube or the blue cube closer to the red bin?": "_cube is nearer: ",
        "is the red cube or the blue cube red?": None,
        "is the blue can in the blue bin?": "No: blue_can is on the table",
        "tell me how many bins there are": "2: red_bin and blue_bin",
        "hey robot, can you tell me where the red ball is?": "red_ball is on the table",
    },
    "stack_five": {
        "how many cubes do you see?": "5: ",
        "which cube is closest to you?": "red_cube is a red block",
        "what is to the left of the blue cube?": "yellow_cube and white_cube are to the left of blue_cube",
        "is there a purple cube?": "No: I see no purple cube",
        "how far is the white cube from the blue cube?": "white_cube is 19 cm from blue_cube",
    },
    "stack_three": {
        "is the red cube on the blue one?": "No: red_cube is on the table",
        "is the red cube on the table?": "Yes: red_cube is on the table",
        "how far is the red cube from the robot?": "cm from the robot's base",
        "what is on the red cube?": "Nothing is on red_cube",
        "what are you holding": "I hold nothing",
        "what do you see?": "red_cube is on the table; green_cube",
    },
    "pick_ball": {"what is the ball": "is a", "is the ball in the gripper?": "No: yellow_ball is on the table", "where's the ball?": "yellow_ball is on the table"},
    "put_in_bin": {
        "is the red cube in the bin?": "No: red_cube is on the table",
        "is the red cube in the bin yet?": "No",
        "what's the bin like": None,
        "is the bin empty?": "Yes",
    },
    "pick_mug_rim": {"where is the mug?": "mug is on the table", "is the mug empty": "Yes: Nothing is in mug", "is the can left of the mug?": "No: yellow_can is 16 cm to the right of mug", "what is on the grey block?": "Nothing is on grey_block"},
    "close_drawer": {"how far open is the drawer?": "100 mm open", "is there anything in the drawer?": "No: "},
    "tap_cube": {"which cube is smaller?": "red_cube is a red", "can the red cube fit in the can?": "can holds nothing"},
    "clear_to_bin": {"how many things are on the table": "9: ", "how many of the cans are empty?": None, "what is under the bin?": None, "what is the biggest thing?": "grey_bin", "how many lemons are there?": None, "what is next to the bin?": "Nothing is next to grey_bin", "describe the scene": "grey_bin is on the table"},
}  # fmt: skip
ASKED = [(task, question) for task, questions in QUESTIONS.items() for question in questions]


def test_every_question_of_the_rules_has_its_answer() -> None:
    book = ruleset("english").written
    asked = {
        about for way in (*book["asked"].source, *book["stated"].source) for about in re.findall(r"about=(\w+)", way)
    }
    assert asked and not [about for about in asked if not hasattr(_Answers, f"_say_{about}")]


@cache
def scene(task: str) -> ObservedScene:
    with open_session(task) as session:
        return session.agent.ctx.look()


@pytest.mark.parametrize(("task", "question"), ASKED)
def test_question_is_answered_and_nothing_moves(task: str, question: str) -> None:
    said = QUESTIONS[task][question]
    answer = StubPlanner(load_skills()).plan(question, scene(task))
    if said is None:
        assert isinstance(answer, Refusal)
    else:
        assert isinstance(answer, Plan) and not answer.steps and said in answer.answer


def test_what_is_not_seen_is_not_said() -> None:
    chest = scene("put_in_drawer")
    hidden = replace(chest, objects=tuple(replace(item, opening=None) for item in chest.objects))
    poured = scene("pour_beads")
    uncounted = replace(poured, objects=tuple(replace(item, grains=()) for item in poured.objects))
    asked = {"is the drawer empty?": hidden, "is the drawer open?": hidden, "how many beads are there?": uncounted}
    for question, seen in asked.items():
        answer = StubPlanner(load_skills()).plan(question, seen)
        assert isinstance(answer, Plan) and "cannot" in answer.answer and "Yes" not in answer.answer, answer


def test_one_place_is_on_no_side_of_itself() -> None:
    tower = scene("pick_from_three")
    one, two, three = tower.objects
    stacked = replace(tower, objects=(one, replace(two, pose=Pose(xyz=(*one.pose.xyz[:2], 0.1))), three))
    for question in (f"is {two.id} in front of {one.id}?", f"is {two.id} behind {one.id}?"):
        answer = StubPlanner(load_skills()).plan(question, stacked)
        assert isinstance(answer, Plan) and answer.answer.startswith("No: "), answer


def test_a_question_without_things_leaves_what_was_spoken_of() -> None:
    planner = StubPlanner(load_skills(), dialogue=True)
    planner.plan("where is the red cube?", scene("pick_from_three"))
    planner.plan("what are you holding?", scene("pick_from_three"))
    answer = planner.plan("pick it up", scene("pick_from_three"))
    assert isinstance(answer, Plan) and [str(call) for call in answer.steps] == ["pick(object=red_cube)"]


def test_what_an_arm_says_of_itself_is_of_the_look_and_not_made_up() -> None:
    with open_session("pick_from_three") as session:
        session.do("pick", object="red_cube")
        seen = session.agent.ctx.look()
        told = StubPlanner(load_skills()).plan("how far is your gripper open?", seen)
        x, y, z = session.state().tcp_pose.xyz
        here = StubPlanner(load_skills()).plan("where is your hand?", seen)
    assert isinstance(told, Plan) and told.answer == "There are 30 mm between my fingers; I hold red_cube."
    assert isinstance(here, Plan) and f"({x:.3f}, {y:.3f}, {z:.3f})" in here.answer
    silent = StubPlanner(load_skills()).plan("where is your hand?", replace(seen, arm=None))
    assert isinstance(silent, Refusal) and silent.message == "I do not know how my own arm stands."


def test_what_is_felt_and_not_seen_is_refused_with_what_feels_it() -> None:
    answer = StubPlanner(load_skills()).plan("how much does the red cube weigh?", scene("pick_from_three"))
    assert isinstance(answer, Refusal)
    assert answer.message == "I cannot see how heavy red_cube is; I can feel it: say “weigh the red cube”."
