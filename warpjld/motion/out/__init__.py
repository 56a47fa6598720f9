"""Export of poses, on the rig's own joints, to motion files of animation programs."""

from __future__ import annotations

from warpjld.motion.out.write import MOTION_OUT, Timing, WrittenMotion, check_motion_out, write_motion

__all__ = ["MOTION_OUT", "Timing", "WrittenMotion", "check_motion_out", "write_motion"]
