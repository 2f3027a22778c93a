"""A visit by the official Python client: mcp_visitor.py stdio COMMAND ... | http URL; prints what each step showed."""

import asyncio
import importlib.metadata
import json
import sys
from typing import Any

from mcp import Client
from mcp.client.stdio import StdioServerParameters

PROMPT = "put the red cube in the bin"
STEPS = [
    {"skill": "pick", "arguments": {"object": "red_cube"}},
    {"skill": "place_in", "arguments": {"container": "grey_bin"}},
]


class Missed(Exception):
    """What did not hold."""


def must(holds: object, what: str) -> None:
    if not holds:
        raise Missed(what)


def place(look: dict[str, Any]) -> list[float]:
    (cube,) = (item for item in look["scene"]["objects"] if item["id"] == "red_cube")
    position: list[float] = cube["position"]
    return position


def away(look: dict[str, Any], other: dict[str, Any]) -> float:
    """Return by how much the joint that moved furthest between two looks did, rad."""
    return max(abs(one - two) for one, two in zip(look["state"]["q"], other["state"]["q"], strict=True))


class Visit:
    """One client's way through the tools; `shown` holds a line for each step."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.shown: dict[str, str] = {}

    async def call(self, tool: str, **arguments: Any) -> dict[str, Any]:
        result = await self.client.call_tool(tool, arguments)
        data: dict[str, Any] = result.structured_content
        return data

    async def lists_tools(self) -> None:
        tools = (await self.client.list_tools()).tools
        must(all(tool.output_schema and tool.annotations for tool in tools), "a tool has no schema or annotations")
        self.shown["tools"] = f"{len(tools)}, each with output schema and annotations"

    async def looks_and_checks(self) -> None:
        self.first = await self.call("look")
        names = [item["id"] for item in self.first["scene"]["objects"]]
        must("red_cube" in names, "look shows no red_cube")
        self.shown["look"] = ", ".join(names)
        checked, turned = await self.call("check", steps=STEPS), await self.call("check", steps=STEPS[1:])
        must(checked["ok"] and not turned["ok"], "check: the plan is fine, its second half is not")
        self.shown["check"] = f"plan ok; without its pick: {turned['problems'][0]['error']['message']}"
        tried = await self.call("simulate", steps=STEPS)
        must(tried["ok"] and len(tried["would_work"]) == 2, "simulate: both calls would work")
        must(place(await self.call("look")) == place(self.first), "simulate moved the cube")
        self.shown["simulate"] = f"{len(tried['would_work'])} calls would work; the cube stays"

    async def runs_and_resets(self) -> None:
        phases: list[str] = []

        async def hear(progress: float, total: float | None, message: str | None) -> None:
            phases.append(message or "")

        must(not (await self.call("judge"))["success"], "judge: nothing is done yet")
        ran = (await self.client.call_tool("run", {"prompt": PROMPT}, progress_callback=hear)).structured_content
        must(ran["success"] and len(phases) > 4, "run: done, with progress")
        self.shown["run"] = f"{len(ran['done'])} calls done, {len(phases)} messages of progress"
        must((await self.call("judge"))["success"], "judge: it is done")
        must((await self.call("reset", seed=0))["seed"] == 0, "reset: to seed 0")
        must(place(await self.call("look")) == place(self.first), "reset: the cube is where it was")
        self.shown["reset"] = "the cube is where it was"
        must(not (await self.call("judge"))["success"], "judge: not any more")
        self.shown["judge"] = "no before, yes after the run, no after the reset"

    async def cancels(self) -> None:
        moving = asyncio.Event()

        async def hear(progress: float, total: float | None, message: str | None) -> None:
            if message and message.endswith(": approach"):
                moving.set()

        running = asyncio.ensure_future(self.client.call_tool("run", {"prompt": PROMPT}, progress_callback=hear))
        await moving.wait()
        while away(self.first, await self.call("look")) < 0.1:
            pass
        running.cancel()
        (ended,) = await asyncio.gather(running, return_exceptions=True)
        must(isinstance(ended, asyncio.CancelledError), "cancel: the run went on to its end")
        while (await self.call("look"))["doing"] is not None:
            pass
        stopped, later = await self.call("look"), await self.call("look")
        must(away(stopped, later) < 2e-3, "cancel: the arm still moves")
        must(stopped["scene"]["held"] is None, "cancel: something is held")
        must(place(stopped) == place(self.first), "cancel: the cube was moved")
        self.shown["cancel"] = "stopped on the way to the cube; arm still, cube untouched"
        must(not (await self.call("judge"))["success"], "judge: a run that was cancelled has done nothing")

    async def errs_and_lists(self) -> None:
        gone = await self.client.call_tool("pick", {"object": "elephant"})
        must(gone.is_error, "pick of an elephant: an error")
        self.shown["error"] = gone.structured_content["error"]["code"]
        resources, prompts = (await self.client.list_resources()).resources, (await self.client.list_prompts()).prompts
        must(len(resources) >= 3 and "do" in [prompt.name for prompt in prompts], "resources and prompts are listed")
        self.shown["lists"] = f"{len(resources)} resources, {len(prompts)} prompts"


async def main(way: str, *command: str) -> None:
    server = StdioServerParameters(command=command[0], args=[*command[1:]]) if way == "stdio" else command[0]
    failed = []
    try:
        async with Client(server) as client:
            visit = Visit(client)
            await visit.lists_tools()
            await visit.looks_and_checks()
            await visit.runs_and_resets()
            await visit.cancels()
            await visit.errs_and_lists()
    except* Missed as missed:
        failed = [str(leaf) for leaf in leaves(missed)]
    about = {"client": f"Python SDK {importlib.metadata.version('mcp')}", "shown": visit.shown}
    print(json.dumps({**about, "failed": "; ".join(failed)}))


def leaves(group: BaseExceptionGroup[Any]) -> list[BaseException]:
    found = [leaves(one) if isinstance(one, BaseExceptionGroup) else [one] for one in group.exceptions]
    return [leaf for one in found for leaf in one]


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
