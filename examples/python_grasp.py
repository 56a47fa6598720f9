"""A hand finds a grasp of a ball, closes on it and presses it, in Python.

python examples/python_grasp.py
"""

import numpy as np

from warpjld.covering import bind
from warpjld.grasp.auto import find_grasp
from warpjld.grasp.close import Closer
from warpjld.grasp.shapes import ball
from warpjld.hand import build_hand
from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
from warpjld.simulation.simulate import simulate
from warpjld.simulation.specification import ContactSpecification, FleshMaterial, SolveSpecification
from warpjld.skeleton import poses_from_angles

rig = build_hand("left")
covering = bind(rig.skeleton, rig.surface)
thing = ball(0.06)
grasp = find_grasp(Closer(covering, thing))
print(f"{grasp.posture}: {', '.join(grasp.touching)} touch; epsilon {grasp.verdict.epsilon:.3f}")

frames = 7
closing = np.linspace(0.0, 1.0, frames - 2)[:, None, None] * (grasp.angles - grasp.start) + grasp.start
squeezed = grasp.angles + np.radians(1.5) * (grasp.angles > grasp.start)  # every joint that closed, on by 1.5°
angles = np.concatenate([closing, 0.5 * (grasp.angles + squeezed)[None], squeezed[None]])
poses = poses_from_angles(
    rig.skeleton,
    angles,
    root_position=np.repeat(grasp.position[None], frames, axis=0),
    root_rotation=np.repeat(grasp.rotation[None], frames, axis=0),
)
hand = RecordedActor("hand", rig, poses=poses, covering=covering)
contact = ContactSpecification(
    flesh={"hand": FleshMaterial(digits=tuple(name.partition(".")[2] for name in grasp.touching), element=0.004)},
    pressing=SolveSpecification(frames - 3, frames - 1),
)
found = simulate(contact, RecordedAnimation([hand], [RecordedObject("ball", thing)]))
print(found.verdict.text)
for row in found.rows:
    if row.frame == found.frames[-1] and row.against:
        print(f"{row.digit}: {row.force_n:.2f} N on {row.area_mm2:.0f} mm², peak {row.peak_kpa:.0f} kPa, {row.state}")
