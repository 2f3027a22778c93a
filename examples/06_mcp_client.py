"""A client of the MCP server: it starts `robo-sandbox mcp`, lists the tools, looks, and has the arm pick a cube up."""

import asyncio
import sys

from mcp import Client
from mcp.client.stdio import StdioServerParameters

SERVER = StdioServerParameters(
    command=sys.executable,
    args=["-c", "from robosandbox.apps.cli import main; main()", "mcp", "--task", "pick_cube_franka"],
)


async def main() -> None:
    async def hear(progress: float, total: float | None, message: str | None) -> None:
        print(f"  {message}")

    async with Client(SERVER) as client:
        print("tools:", *(tool.name for tool in (await client.list_tools()).tools))
        look = await client.call_tool("look")
        cube = look.structured_content["scene"]["objects"][0]["id"]
        result = await client.call_tool("pick", {"object": cube}, progress_callback=hear)
        print(f"success={not result.is_error}  {result.structured_content['detail']}")


asyncio.run(main())
