"""A client that imports only zenoh and json: send a pick, follow it, print the result. Start `robo-sandbox sim` first."""

import json

import zenoh

ENDPOINT = "tcp/127.0.0.1:7447"
ROBOT = "robosandbox/robot"


def ask(session, key, message):
    for reply in session.get(f"{ROBOT}/{key}", payload=json.dumps(message)):
        if reply.ok is None:
            raise SystemExit(f"refused: {json.loads(reply.err.payload.to_bytes())['message']}")
        return json.loads(reply.ok.payload.to_bytes())
    raise SystemExit(f"nobody serves {ROBOT} at {ENDPOINT}")


def main():
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([ENDPOINT]))
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        raise SystemExit(f"nobody listens at {ENDPOINT}: start `robo-sandbox sim` first") from None
    with session:
        # A goal needs a UUID; this session's own random number is as good as one from a library.
        digits = str(session.info.zid()).zfill(32)
        goal = {"goal_id": "-".join((digits[:8], digits[8:12], digits[12:16], digits[16:20], digits[20:]))}
        news = session.declare_subscriber(f"{ROBOT}/goal/{goal['goal_id']}/*")
        ask(session, "skill/pick/send_goal", {**goal, "arguments": {"object": "red_cube"}, "timeout": 60})
        for sample in news:
            said = json.loads(sample.payload.to_bytes())
            print(f"{said['time']:6.2f} s  {said['phase']}" if "phase" in said else said["status"])
            if said.get("status") in ("succeeded", "failed", "cancelled"):
                break
        done = ask(session, "skill/pick/get_result", goal)
        print(json.dumps(done["result"] or done["error"], indent=2))
        return done["status"] != "succeeded"


if __name__ == "__main__":
    raise SystemExit(main())
