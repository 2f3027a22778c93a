"""Ten lines: a table with a cube, a sentence, and what came of it. Needs no key, no GPU, no display."""

from robosandbox import open_session

with open_session("pick_cube_franka") as session:
    episode = session.run("pick up the red cube")
    for step in episode.steps:
        print(step.call.skill, step.result.detail)
    print(f"success={episode.success}  judged={session.judge().success}  reason={episode.final_reason}")
raise SystemExit(not episode.success)
