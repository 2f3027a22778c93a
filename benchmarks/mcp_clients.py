"""The MCP server driven by the official Python and JavaScript clients, over stdio and HTTP: what each step of a visit shows.

    uv run benchmarks/mcp_clients.py [--clients python javascript] [--ways stdio http] [--json]

Both clients do the same (`tests/support/mcp_visitor.py`, `.mjs`): list the tools, look, check a plan and a wrong one, simulate, run a sentence
with progress, judge, reset, cancel a run while the arm moves, and make a mistake. The JavaScript client is installed from npm into a temporary
folder. Exit 1 where a step does not hold; a client that cannot be installed is left out and named.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from support.processes import mcp_command, mcp_over_http

VISITORS = Path(__file__).resolve().parents[1] / "tests" / "support"
CLIENTS = ("python", "javascript")
WAYS = ("stdio", "http")
STEPS = ("look", "check", "simulate", "run", "cancel", "reset", "judge")
# At the speed of the clock a pick takes seconds, so that there is something to cancel.
OPTIONS = ("--task", "put_in_bin", "--realtime")
SDK = "@modelcontextprotocol/sdk@1"
# Seconds for npm, and for a visit, which takes half a minute. Chosen: what takes longer hangs.
_PATIENCE = 600.0


def install(client: str, folder: Path) -> list[str]:
    """Return the command of a client's visitor, with what it needs installed in a folder.

    Raises:
        FileNotFoundError: There is no npm.
        subprocess.CalledProcessError: npm could not install the client.
    """
    if client == "python":
        return [sys.executable, str(VISITORS / "mcp_visitor.py")]
    npm = shutil.which("npm")
    if npm is None:
        raise FileNotFoundError("no npm here")
    script = shutil.copy(VISITORS / "mcp_visitor.mjs", folder)
    subprocess.run([npm, "install", "--silent", SDK], cwd=folder, check=True, timeout=_PATIENCE)
    return ["node", script]


def visit(visitor: list[str], way: str) -> dict[str, Any]:
    """Let a client visit a server of its own.

    Returns:
        `client`, its name and version, `shown`, a line for each step that held, and `failed`, what did not.

    Raises:
        RuntimeError: The client itself broke.
    """
    with contextlib.ExitStack() as stack:
        where = mcp_command(*OPTIONS) if way == "stdio" else [stack.enter_context(mcp_over_http(*OPTIONS))]
        done = subprocess.run([*visitor, way, *where], capture_output=True, text=True, timeout=_PATIENCE, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip()[-2000:])
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> int:
    """Print a row per client and way, and what the steps showed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clients", nargs="+", choices=CLIENTS, default=CLIENTS)
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for client in arguments.clients:
            try:
                visitor = install(client, Path(folder))
            except (FileNotFoundError, subprocess.CalledProcessError) as error:
                print(f"{client}: left out: {error}", file=sys.stderr)
                continue
            rows += [{"way": way, **visited(client, visitor, way)} for way in arguments.ways]
    if arguments.json:
        print(json.dumps(rows, indent=1))
    else:
        print("\n".join(table(rows)))
    return 1 if any(row["failed"] for row in rows) else 0


def visited(client: str, visitor: list[str], way: str) -> dict[str, Any]:
    """Return what a visit showed, or how it failed."""
    try:
        return visit(visitor, way)
    except (RuntimeError, subprocess.TimeoutExpired) as error:
        return {"client": client, "shown": {}, "failed": str(error)}


def table(rows: list[dict[str, Any]]) -> list[str]:
    """Return a table of the steps, and below it what each showed."""
    lines = [f"| client | way | {' | '.join(STEPS)} |", f"|{'---|' * (len(STEPS) + 2)}"]
    for row in rows:
        held = " | ".join("yes" if step in row["shown"] else "NO" for step in STEPS)
        lines.append(f"| {row['client']} | {row['way']} | {held} |")
    for row in rows:
        lines += ["", f"{row['client']}, {row['way']}: {row['failed']}"]
        lines += [f"  {step:<9} {shown}" for step, shown in row["shown"].items()]
    return lines


if __name__ == "__main__":
    raise SystemExit(main())
