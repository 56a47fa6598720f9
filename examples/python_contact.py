"""A fingertip presses on a plate, in Python: force, contact area, and the share of the finger's muscle force.

python examples/python_contact.py
"""

import numpy as np
import trimesh

import warpjld as wj

rig = wj.build_hand("left")
frames = 9
down = np.zeros((frames, 3))
down[:, 1] = np.linspace(0.0, -0.0063, frames)  # the hand goes down by 6.3 mm [m]
hand = wj.RecordedActor("hand", rig, angles=np.zeros((frames, len(rig.skeleton), 4)), root=down)
plate = wj.RecordedObject("plate", trimesh.creation.box((0.036, 0.006, 0.036)), positions=(0.034, -0.0275, -0.165))

contact = wj.ContactSpecification(
    flesh={"hand": wj.FleshMaterial(digits=("index",))}, pressing=wj.SolveSpecification(0, 8, every=2)
)
found = wj.simulate(contact, wj.RecordedAnimation([hand], [plate]))

print(found.verdict.text)
for frame, force, pressure in zip(found.frames, found.force("hand"), found.pressure, strict=True):
    print(f"frame {frame:g}: {force[1]:.3f} N upwards on the finger, peak {pressure.max() / 1e3:.1f} kPa")
