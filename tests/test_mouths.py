"""Whatever one mouth of a workcell can do, all can: the table of docs/mouths.md, cell by cell."""

from collections.abc import Iterator

import pytest
from support.mouths import CHROMIUM, HARDWARE, MOUTHS, Mouth, ViewerMouth

pytestmark = pytest.mark.gl
NO_BROWSER = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (apt-get install chromium)")
NAMES = [pytest.param(name, marks=NO_BROWSER) if name == "viewer" else name for name in MOUTHS]
STEPS = [{"skill": "pick", "arguments": {"object": "red_cube"}}]


@pytest.fixture(scope="module", params=NAMES)
def opened(request: pytest.FixtureRequest) -> Iterator[Mouth]:
    with MOUTHS[request.param]("--task", "pick_from_three") as mouth:
        yield mouth


@pytest.fixture
def mouth(opened: Mouth) -> Mouth:
    assert opened.reset(0).ok
    return opened


def test_run(mouth: Mouth) -> None:
    assert mouth.say("pick up the red cube").ok
    assert mouth.held() == "red_cube"


def test_answer(mouth: Mouth) -> None:
    asked = mouth.say("pick up the cube")
    assert not asked.ok and "Which one do you mean" in asked.text
    assert mouth.say("the left one").ok
    assert mouth.held() == "blue_cube"


def test_click(opened: Mouth) -> None:
    if not isinstance(opened, ViewerMouth):
        pytest.skip("there is nothing to click")
    opened.reset(0)
    assert not opened.say("pick up the cube").ok
    assert opened.press("green_cube").ok and opened.held() == "green_cube"


def test_skill(mouth: Mouth) -> None:
    assert mouth.call("pick", object="red_cube").ok
    assert mouth.held() == "red_cube"


def test_hand(mouth: Mouth) -> None:
    assert mouth.call("move_to", x=0.2, y=0.1, z=0.3).ok
    assert mouth.tcp() == pytest.approx((0.2, 0.1, 0.3), abs=0.003)


def test_plan(mouth: Mouth) -> None:
    assert "pick(object=red_cube)" in mouth.order("plan", prompt="pick up the red cube").text
    assert mouth.held() is None
    assert not mouth.order("plan", prompt="pick up the banana").ok


def test_check(mouth: Mouth) -> None:
    assert mouth.order("check", steps=STEPS).ok
    assert mouth.held() is None


def test_simulate(mouth: Mouth) -> None:
    assert mouth.order("simulate", steps=STEPS).ok
    assert mouth.held() is None


def test_achieve(mouth: Mouth) -> None:
    assert mouth.order("achieve", goals=["holding(green_cube)"]).ok
    assert mouth.held() == "green_cube"


def test_follow(mouth: Mouth) -> None:
    assert mouth.order("follow", steps=STEPS).ok
    assert mouth.held() == "red_cube"


def test_judge(mouth: Mouth) -> None:
    assert not mouth.order("judge").ok
    assert mouth.call("pick", object="green_cube").ok
    assert mouth.order("judge").ok


def test_reset(mouth: Mouth) -> None:
    assert mouth.call("pick", object="red_cube").ok
    assert mouth.reset(3).ok
    assert mouth.held() is None


def test_undo(mouth: Mouth) -> None:
    assert mouth.say("pick up the red cube").ok
    assert "pick" in mouth.undo().text
    assert mouth.held() is None


def test_load(mouth: Mouth) -> None:
    assert mouth.load("pick_cube_franka").ok and mouth.task() == "pick_cube_franka"
    assert mouth.say("pick up the red cube").ok
    assert mouth.load("pick_from_three").ok and mouth.task() == "pick_from_three"


@pytest.mark.alone
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.sample(every=3)
def test_stop(name: str) -> None:
    with MOUTHS[name]("--task", "pick_from_three", "--realtime") as mouth:
        assert not mouth.stopped("pick up the red cube").ok
        assert mouth.held() is None
        assert mouth.call("open_gripper").ok, "it goes on"


@pytest.mark.alone
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.sample(every=3)
def test_recover(name: str) -> None:
    with MOUTHS[name]("--task", "pick_from_three", *HARDWARE) as mouth:
        assert not mouth.stalled("move_to", x=0.2, y=0.1, z=0.3).ok
        assert "nothing moves before recover" in mouth.call("open_gripper").text
        assert "between two control ticks" in mouth.recover().text
        assert mouth.call("open_gripper").ok
