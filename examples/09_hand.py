"""The hand by itself: measure the table's height by touching it, then carry a block tilted and at a known force.

python examples/09_hand.py
"""

from __future__ import annotations

import robosandbox


def main() -> None:
    """Touch the table, pick a block up, squeeze it, tilt it, and say what was measured."""
    with robosandbox.open_session(task="pick_from_three") as cell:
        cell.do("move_to", x=0.4, y=-0.1, z=0.12)
        cell.do("close_gripper")
        felt = cell.do("move_by", dz=-0.2, until_force=2.0).detail
        print(f"touched after {-1000 * float(felt['dz']):.0f} mm with {felt['force_n']:.0f} N")
        cell.do("move_by", dz=0.1)
        cell.pick("red_cube")
        grip = cell.do("close_gripper", force=10.0).detail
        print(f"holds {grip['held']} with {grip['force_n']:.1f} N")
        there = cell.do("move_to", x=0.3, y=0.1, z=0.35, tilt=0.5, towards=0.8).detail
        print(f"tilted, {there['off_mm']:.1f} mm and {there['off_deg']:.2f} degrees off")
        print(f"success={cell.observe().held == 'red_cube'}")


if __name__ == "__main__":
    main()
