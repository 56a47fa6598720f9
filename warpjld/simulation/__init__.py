"""Grasping and pressing over the frames of an animation: bodies from a scene, contact solved, what came of it (B §3.3,
§3.4, R91–R130)."""
