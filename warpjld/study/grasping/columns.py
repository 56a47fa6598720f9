"""Columns of a grasp study's table.

All columns are in the frame of the object, which does not move: Y up, the centre of its bounding box at the origin.
"""

from __future__ import annotations

from warpjld.tables.columns import Column

__all__ = ["GRASP_COLUMNS", "PRESSED_COLUMNS", "SCORE_COLUMNS"]

_PARTS = ("thumb", "index", "middle", "ring", "pinky", "palm")
_PLANNED = (
    Column("hand", "text", "", "Name of the hand in the study file."),
    Column("object", "text", "", "Name of the object in the study file."),
    Column("scale", "number", "", "Scale of the object."),
    Column("friction", "number", "", "Coulomb coefficient of skin on object."),
)
_PLACED = (
    Column("approach_x", "number", "", "Unit vector from the object towards the approaching hand, object frame, x."),
    Column("approach_y", "number", "", "The same, y."),
    Column("approach_z", "number", "", "The same, z."),
    Column("gap", "number", "m", "Distance between palm and object along the approach, before closing."),
    Column("tilt", "number", "rad", "Angle between the palm's normal and the approach."),
)
_WRIST = (
    Column("wrist_x", "number", "m", "Position of the wrist joint, object frame, x."),
    Column("wrist_y", "number", "m", "The same, y."),
    Column("wrist_z", "number", "m", "The same, z."),
)
_TOUCH = (
    Column("contacts", "integer", "", "Number of contact patches: one per segment of the hand that touches."),
    Column("digits", "integer", "", "Number of digits in contact, thumb included, palm not."),
    Column("area", "number", "m²", "Area of skin in contact."),
    *(Column(f"area_{part}", "number", "m²", f"Area of skin of the {part} in contact.")
      for part in _PARTS),
)  # fmt: skip
_MEASURED = (
    Column("penetration", "number", "m", "The larger of skin_inside and object_inside."),
    Column("skin_inside", "number", "m", "Depth of the deepest point of the skin inside the object; 0 where none is."),
    Column("object_inside", "number", "m", "Depth of the object's deepest vertex, or point of a sharp edge, inside the"
           " skin; 0 where none is."),
    Column("overlap", "number", "m³", "Volume common to hand and object, on a grid (see warpjld.grasp.Intersection)."),
    Column("self_penetration", "number", "m", "Depth of the deepest vertex of a digit or the palm in another part"
           " of the hand; 0 where none is."),
    Column("touching", "text", "", "Parts of the hand in contact, of: thumb index middle ring pinky palm."),
    Column("closed", "truth", "", "Force closure with discretised cones (Nguyen 1988)."),
    Column("margin", "number", "", "Evenness of the internal force: smallest share of a cone edge × number of edges."),
    Column("epsilon", "number", "N", "Ferrari–Canny epsilon for 1 N of normal force, torques divided by torque_scale."),
    Column("volume", "number", "N⁶", "Volume of the grasp wrench space, for the same forces."),
    Column("torque_scale", "number", "m", "Length ρ that torques are divided by."),
    Column("mass", "number", "kg", "Mass of the object."),
    Column("displacement", "number", "m", "Largest displacement of the centre of mass under gravity from ±x, ±y, ±z;"
           " empty where a direction is not held."),
    Column("held", "integer", "", "In how many of these six directions the weight is held."),
    Column("lift", "number", "", "Multiple of the object's weight that is held against gravity along −y by a total"
           " normal force of squeeze; above 1 it is lifted, quasi-statically."),
    Column("lift_least", "number", "", "Smallest lift over gravity along ±x, ±y, ±z."),
    Column("success", "truth", "", "Force closure, penetration and displacement within the study's limits."),
)  # fmt: skip

GRASP_COLUMNS = (*_PLANNED, *_PLACED, *_WRIST, *_TOUCH, *_MEASURED)
"""Columns of a grasp study after ``COMMON_COLUMNS``."""

SCORE_COLUMNS = (
    Column("grasp", "text", "", "Name of the grasp in its file."), *_PLANNED, *_WRIST, *_TOUCH, *_MEASURED
)  # fmt: skip
"""Columns for grasps from other programs, whose approach is unknown."""

PRESSED_COLUMNS = (
    Column("weight", "number", "N", "What hangs on the object."),
    Column("press", "text", "", "How contact was solved: REACHED, or why the force was not; empty where the grasp"
           " is no success."),
    Column("asked_force", "number", "N", "Sum of the digits' forces that holds the weight with the study's margin."),
    Column("grip", "number", "rad", "How far each joint bent on."),
    Column("force", "number", "N", "Sum over the digits of the length of what contact puts on their bones."),
    Column("normal_force", "number", "N", "What presses on the skin of the whole hand, summed over its area."),
    Column("pressed_area", "number", "m²", "Skin under pressure."),
    Column("peak_pressure", "number", "Pa", "Highest pressure: what presses on a node over the skin around it."),
    Column("muscle_share", "number", "", "Largest share of the muscles' limits, in force or in a joint's torque."),
    Column("strained", "text", "", "Digit that has it."),
    Column("without_share", "text", "", "Digits that press with less than their share, as far as they may bend on: by"
           " how much their skin stays short of the object; touching, if they slip off or reach too little;"
           " on bone, if flesh of coarse elements lets a bone come to the object."),
    *(Column(f"force_{part}", "number", "N", f"Length of the sum of the contact forces on the skin of the {part}.")
      for part in _PARTS),
    *(Column(f"pressed_area_{part}", "number", "m²", f"Skin of the {part} under pressure.") for part in _PARTS),
    *(Column(f"share_{part}", "number", "", f"Share of the muscles' limits of the {part}.") for part in _PARTS[:-1]),
)  # fmt: skip
"""Additional columns of a study that solves contact."""
