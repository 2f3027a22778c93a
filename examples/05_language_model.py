"""A language model plans, and its first answer is wrong: it is told why, and nothing moves until the plan can be right.

Without a key a scripted server on this machine stands in for the model. With one:

    OPENAI_API_KEY=... uv run examples/05_language_model.py MODEL
"""

import sys

from robosandbox import open_session
from robosandbox.apps.conformance.openai_server import ScriptedServer, plan

SCRIPT = (
    plan(("pick", {"object": "crimson_cube"})),
    plan(("pick", {"object": "red_cube"}), ("place_in", {"container": "grey_bin"})),
)


def main() -> None:
    with ScriptedServer(*SCRIPT) as server:
        own = len(sys.argv) > 1
        options = {"model": sys.argv[1]} if own else {"model": "scripted", "base_url": server.url}
        with open_session("put_in_bin", planner="openai", planner_options=options) as session:
            episode = session.run("please tidy the cube away")
            print(f"success={episode.success}  plan={', '.join(map(str, episode.plan.steps if episode.plan else ()))}")
        if not own:
            print(f"the model was told: {server.requests[-1]['messages'][-1]['content']}")


if __name__ == "__main__":
    main()
