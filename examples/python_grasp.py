"""A hand finds a grasp of a ball, closes on it and presses it, in Python.

python examples/python_grasp.py
"""

import numpy as np

import warpjld as wj

rig = wj.build_hand("left")
covering = wj.bind(rig)
thing = wj.shapes.ball(0.06)
grasp = wj.find_grasp(covering, thing)
print(grasp)

frames = 7
closing = np.linspace(0.0, 1.0, frames - 2)[:, None, None] * (grasp.angles - grasp.start) + grasp.start
squeezed = grasp.angles + np.radians(1.5) * (grasp.angles > grasp.start)  # every joint that closed, on by 1.5°
angles = np.concatenate([closing, 0.5 * (grasp.angles + squeezed)[None], squeezed[None]])
poses = wj.poses_from_angles(
    rig.skeleton,
    angles,
    root_position=np.repeat(grasp.position[None], frames, axis=0),
    root_rotation=np.repeat(grasp.rotation[None], frames, axis=0),
)
hand = wj.RecordedActor("hand", rig, poses=poses, covering=covering)
contact = wj.ContactSpecification(
    flesh={"hand": wj.FleshMaterial(digits=tuple(name.partition(".")[2] for name in grasp.touching), element=0.004)},
    pressing=wj.SolveSpecification(frames - 3, frames - 1),
)
found = wj.simulate(contact, wj.RecordedAnimation([hand], [wj.RecordedObject("ball", thing)]))
print(found.verdict.text)
for row in found.rows:
    if row.frame == found.frames[-1] and row.against:
        print(f"{row.digit}: {row.force_n:.2f} N on {row.area_mm2:.0f} mm², peak {row.peak_kpa:.0f} kPa, {row.state}")
