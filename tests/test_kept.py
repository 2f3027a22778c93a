"""What a sim process has accepted it still knows after its death; what its state files hold is checked before it is served."""

import json
import resource
import subprocess
import sys
import threading
import uuid
from pathlib import Path
from typing import Any

import pytest

from robosandbox.errors import InputError
from robosandbox.workcell.zenoh.messages import Goal, GoalStatus
from robosandbox.workcell.zenoh.server.journal import COMPACT_BYTES, Acceptance, Journal, KeptGoal, read_journal

ROOT = Path(__file__).resolve().parents[1]
BOOT = "a boot"


def acceptance(number: int, boot: str = BOOT, **arguments: Any) -> Acceptance:
    goal = Goal(goal_id=str(uuid.UUID(int=number)), boot_id=boot, skill="pick", status=GoalStatus.ACCEPTED)
    return Acceptance(number=number, goal=goal, arguments=arguments)


def numbers(goals: list[KeptGoal]) -> list[int]:
    return [uuid.UUID(item.goal.goal_id).int for item in goals]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "world.json.goals"


def written(path: Path, *acceptances: Acceptance) -> bytes:
    journal = Journal(path)
    journal.start()
    for item in acceptances:
        journal.keep(item)
    # What a kill at this moment would leave.
    content = path.read_bytes()
    journal.stop()
    return content


def test_kept_goal_is_in_the_file_before_anything_is_flushed_or_closed(path: Path) -> None:
    content = written(path, acceptance(1, object="red_cube"), acceptance(2))
    path.write_bytes(content)
    found = read_journal(path, BOOT, 0)
    assert numbers(found) == [1, 2] and found[0].arguments == {"object": "red_cube"}


def test_journal_cut_at_any_byte_gives_the_whole_records_before_it(path: Path) -> None:
    content = written(path, *(acceptance(number, object="é\n") for number in (1, 2, 3)))
    ends = [index + 1 for index, byte in enumerate(content) if byte == ord("\n")]
    for cut in range(len(content) + 1):
        path.write_bytes(content[:cut])
        # A record without its line feed is whole too.
        whole = sum(cut >= end - 1 for end in ends)
        assert numbers(read_journal(path, BOOT, 0)) == list(range(1, whole + 1)), cut


@pytest.mark.parametrize("junk", [0x00, 0x0A, 0x41, 0xFF])
def test_journal_damaged_at_any_byte_loses_at_most_the_records_there(path: Path, junk: int) -> None:
    content = written(path, *(acceptance(number) for number in (1, 2, 3)))
    for place in range(len(content)):
        path.write_bytes(content[:place] + bytes([junk]) + content[place + 1 :])
        found = numbers(read_journal(path, BOOT, 0))
        assert set(found) <= {1, 2, 3} and len(found) >= 1, place
        damaged = content[:place].count(b"\n") + 1
        # The line feed between two records joins them when it is lost.
        assert {1, 2, 3} - set(found) <= {damaged, damaged + 1}, place


def test_records_of_another_process_and_those_already_saved_are_left_out(path: Path) -> None:
    path.write_bytes(written(path, acceptance(1), acceptance(2, boot="another"), acceptance(3)))
    assert numbers(read_journal(path, BOOT, 1)) == [3]
    assert read_journal(path.with_name("nothing"), BOOT, 0) == []


def test_journal_stays_small_while_goals_are_saved(path: Path) -> None:
    journal = Journal(path)
    journal.start()
    largest = 0
    for number in range(1, 4001):
        journal.keep(acceptance(number, text="x" * 200))
        journal.forget(number - 1)
        if number % 50 == 0:
            flushed = threading.Event()
            journal.when_flushed(flushed.set)
            assert flushed.wait(10.0)
        largest = max(largest, path.stat().st_size)
    journal.stop()
    assert largest < 1.5 * COMPACT_BYTES
    assert numbers(read_journal(path, BOOT, 3999)) == [4000]


def test_goals_that_wait_for_a_flush_begin_in_their_order_and_none_is_lost_at_the_end(path: Path) -> None:
    journal = Journal(path)
    journal.start()
    begun: list[int] = []
    for number in range(1, 101):
        journal.keep(acceptance(number))
        journal.when_flushed(lambda number=number: begun.append(number))  # type: ignore[misc]
    journal.stop()
    assert begun == list(range(1, 101))


def test_record_that_does_not_fit_on_the_disk_spoils_none_after_it(path: Path) -> None:
    journal = Journal(path)
    journal.start()
    journal.keep(acceptance(1))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # The second record fits in part, as on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 100, hard))
    try:
        with pytest.raises(OSError):
            journal.keep(acceptance(2))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    journal.keep(acceptance(3))
    assert numbers(read_journal(path, BOOT, 0)) == [1, 3]
    journal.stop()


def test_journal_that_is_no_file_is_one_line(path: Path) -> None:
    path.mkdir()
    with pytest.raises(InputError, match="is no file"):
        read_journal(path, BOOT, 0)


def test_goals_open_at_a_kill_are_known_afterwards() -> None:
    command = [sys.executable, str(ROOT / "benchmarks" / "faults.py"), "accepted", "--times", "1", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout)["accepted"]
    assert row["known"] == row["accepted"] >= 1, row
