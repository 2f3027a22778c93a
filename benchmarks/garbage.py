"""Generated nonsense for every queryable of a sim: each must be answered with a typed error, and the sim must live.

python benchmarks/garbage.py [--payloads 10000] [--seed 0] [--json]
"""

from __future__ import annotations

import argparse
import json
import random
import string
import time
import uuid
from collections import Counter
from typing import Any

import zenoh
from pydantic import TypeAdapter
from support.processes import SimProcess

from robosandbox.errors import ErrorCode, InvalidMessageError
from robosandbox.types import Truth
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.messages import (
    PROTOCOL,
    Ask,
    Clock,
    GoalRef,
    Load,
    Message,
    Reset,
    SendGoal,
    decode,
)

CODES = frozenset(code for name, code in vars(ErrorCode).items() if name.isupper())
QUERYABLES: dict[str, type[Message]] = {
    "info": Ask,
    "truth": Ask,
    "checkpoint": Ask,
    "skill/run/send_goal": SendGoal,
    "skill/simulate/send_goal": SendGoal,
    "obs/state": Ask,
    "obs/objects": Ask,
    "reset": Reset,
    "load": Load,
    "clock": Clock,
    "skill/pick/send_goal": SendGoal,
    "skill/push/send_goal": SendGoal,
    "skill/pick/cancel_goal": GoalRef,
    "skill/pick/get_result": GoalRef,
}
NAMES = (
    "**",
    "*",
    "..",
    "../..",
    "/etc/passwd",
    "$*",
    "",
    " ",
    "red_cube\x00",
    "ü",
    "☃",
    "a" * 5000,
    "%2e%2e",
    "__proto__",
)
NUMBERS = (
    "NaN",
    "Infinity",
    "-Infinity",
    "1e999",
    "-1e999",
    "1e-999",
    "9" * 400,
    "-0",
    "-1",
    "1e308",
    "2147483648",
)


class Nonsense:
    """A seeded source of payloads."""

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)

    def payload(self, model: type[Message]) -> bytes:
        """Return bytes that are hardly ever a message of this kind."""
        makers = (
            self._noise,
            self._utf8,
            self._truncated,
            self._mutated,
            self._mutated,
            self._deep,
            self._huge,
            self._text,
        )
        weights = (3, 1, 3, 8, 8, 1, 0.02, 2)
        return self._rng.choices(makers, weights)[0](model)

    def _noise(self, _: type[Message]) -> bytes:
        return self._rng.randbytes(self._rng.randrange(0, 200))

    def _utf8(self, model: type[Message]) -> bytes:
        good = bytearray(json.dumps(self._valid(model)).encode())
        good[self._rng.randrange(len(good))] = self._rng.choice((0xFF, 0xC0, 0x80, 0xED))
        return bytes(good)

    def _truncated(self, model: type[Message]) -> bytes:
        good = json.dumps(self._valid(model)).encode()
        return good[: self._rng.randrange(len(good))]

    def _deep(self, _: type[Message]) -> bytes:
        depth = self._rng.choice((50, 300, 5000))
        opening, closing = self._rng.choice((("[", "]"), ('{"a":', "}")))
        return (opening * depth + "1" + closing * self._rng.choice((depth, 0))).encode()

    def _huge(self, _: type[Message]) -> bytes:
        return b'{"goal_id":"' + b"x" * self._rng.choice((100_000, 2_000_000)) + b'"}'

    def _text(self, _: type[Message]) -> bytes:
        letters = string.printable + "äßé☃"
        return "".join(self._rng.choices(letters, k=self._rng.randrange(0, 80))).encode()

    def _mutated(self, model: type[Message]) -> bytes:
        """A valid message with one to three fields made wrong."""
        fields = {name: json.dumps(value) for name, value in self._valid(model).items()}
        for _ in range(self._rng.randrange(1, 4)):
            name = self._rng.choice([*fields, "extra", "protocol"])
            fields[name] = self._value()
        return ("{" + ",".join(f"{json.dumps(name)}:{value}" for name, value in fields.items()) + "}").encode()

    def _value(self) -> str:
        match self._rng.randrange(6):
            case 0:
                return self._rng.choice(NUMBERS)
            case 1:
                return json.dumps(self._rng.choice(NAMES))
            case 2:
                return self._rng.choice(("null", "true", "[]", "{}", "[[[]]]", '""', "[1,2", "{"))
            case 3:
                return json.dumps({self._rng.choice(NAMES): self._rng.choice(NAMES)})
            case 4:
                return json.dumps({"object": self._rng.choice(NAMES), "direction": 1, "distance": "x"})
            case _:
                return json.dumps("".join(self._rng.choices(string.printable, k=self._rng.randrange(1, 60))))

    def _valid(self, model: type[Message]) -> dict[str, Any]:
        foreign = str(uuid.UUID(int=self._rng.getrandbits(128), version=4))
        if model is SendGoal:
            return {"protocol": PROTOCOL, "goal_id": foreign, "arguments": {"object": "red_cube", "speed": 3}}
        if model is GoalRef:
            return {"protocol": PROTOCOL, "goal_id": foreign}
        if model is Reset:
            return {"protocol": PROTOCOL, "checkpoint": self._rng.choice(NAMES)[:64]}
        if model is Load:
            return {"protocol": PROTOCOL, "task": self._rng.choice(NAMES)[:64]}
        if model is Clock:
            return {"protocol": PROTOCOL, "step": -1.0}
        return {"protocol": 7}


def torment(count: int, seed: int) -> dict[str, Any]:
    """Send `count` payloads to every queryable and to keys with strange names, then pick something."""
    source = Nonsense(seed)
    answers: Counter[str] = Counter()
    wrong: list[str] = []
    begin = time.monotonic()
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        whole = TypeAdapter(Truth).dump_json
        before = whole(robot.truth())
        for suffix, model in QUERYABLES.items():
            for _ in range(count):
                payload = source.payload(model)
                answer = ask(client.session, f"robosandbox/robot/{suffix}", payload)
                answers[answer] += 1
                if answer not in CODES and not (answer == "ok" and _is_valid(payload, model)):
                    wrong.append(f"{suffix}: {answer}: {payload[:80]!r}")
        for part in ("**", "*", "..", "x", "ü", "pick$*", "a" * 300, "obs"):
            for suffix in (f"skill/{part}/send_goal", f"skill/{part}/get_result", f"obs/camera/{part}/rgb"):
                answer = ask(client.session, f"robosandbox/robot/{suffix}", b"{}")
                answers[f"key: {answer}"] += 1
                if answer not in CODES:
                    wrong.append(f"{suffix}: {answer}")
        untouched = whole(robot.truth()) == before
        picked = robot.send("pick", {"object": "red_cube"}).wait(60.0).skill == "pick"
        alive = sim.running
    return {
        "payloads": count * len(QUERYABLES),
        "queryables": len(QUERYABLES),
        "answers": dict(answers.most_common()),
        "wrong": wrong[:20],
        "wrong_count": len(wrong),
        "physics_untouched": untouched,
        "pick_afterwards": picked and alive,
        "seconds": round(time.monotonic() - begin, 1),
    }


def ask(session: zenoh.Session, key: str, payload: bytes) -> str:
    """Return "ok", an error's code, or what went wrong."""
    for reply in session.get(key, payload=payload, timeout=20.0):
        if reply.ok is not None:
            return "ok"
        try:
            return str(json.loads(reply.err.payload.to_bytes())["code"]) if reply.err else "no answer"
        except (ValueError, KeyError, TypeError):
            return "untyped error"
    return "no answer"


def _is_valid(payload: bytes, model: type[Message]) -> bool:
    try:
        decode(payload, model)
    except InvalidMessageError:
        return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--payloads", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    result = torment(arguments.payloads, arguments.seed)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for name, value in result.items():
            print(f"{name:20} {value}")


if __name__ == "__main__":
    main()
