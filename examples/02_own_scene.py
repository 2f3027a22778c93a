"""A scene of your own, put together from the parts: world, perception, grasps, motion, skills, planner.

The robot is the bundled Panda; `robot_urdf=Path("my_arm.xml")` in the scene, with a sidecar beside the file, is yours.
"""

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.planner import StubPlanner
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.home import Home
from robosandbox.skills.pick import Pick
from robosandbox.types import Pose, Scene, SceneObject


def main() -> int:
    scene = Scene(
        objects=(
            SceneObject(
                id="red_cube",
                kind="box",
                size=(0.012, 0.012, 0.012),
                pose=Pose(xyz=(0.1, 0.0, 0.06)),
                rgba=(0.85, 0.2, 0.2, 1.0),
                mass=0.05,
            ),
        ),
    )

    sim = MuJoCoBackend(render_size=(240, 320))
    sim.load(scene)
    try:
        ctx = AgentContext(
            sim=sim,
            perception=GroundTruthPerception(),
            grasp=AnalyticTopDown(),
            motion=DLSMotionPlanner(n_waypoints=160, dt=0.005),
        )
        skills = [Pick(), Home()]
        agent = Agent(ctx=ctx, skills=skills, planner=StubPlanner(skills))
        ep = agent.run("pick up the red cube")
        print(f"success={ep.success}  steps={len(ep.steps)}  reason={ep.final_reason}")
    finally:
        sim.close()
    return 0 if ep.success else 1


if __name__ == "__main__":
    raise SystemExit(main())
