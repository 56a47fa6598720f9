"""The table of a contact solve as its frames come, and what the muscles say (R95, R118, R119)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.fem.hand.muscles import Effort
    from warpjld.simulation.bodies.model import Bodies
    from warpjld.simulation.solve.solved_frame import SolvedFrame
    from warpjld.simulation.report.table import Row
    from warpjld.script.scene import Scene

__all__ = ["PressRows"]


class PressRows:
    """Rows as frames are solved.

    Attributes:
        rows: Those so far.
    """

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        self._scene, self._bodies = scene, bodies
        self.rows: list[Row] = []
        self._efforts: list[tuple[str, float, Effort]] = []

    def note(self, solved: SolvedFrame) -> str | None:
        """Add rows; never stops."""
        self.take(solved)
        return None

    def take(self, solved: SolvedFrame) -> str | None:
        """Add rows; a text where muscles can do no more (R118)."""
        from warpjld.simulation.report.efforts import effort_at
        from warpjld.simulation.report.table import rows_of

        reason = None
        for hand in self._bodies.hands:
            poses = stage(self._scene.actor(hand.name), np.array([solved.frame]), self._scene.rate)
            limits = self._scene.contact.strength.get(hand.name)
            effort = effort_at(self._bodies, hand, poses, solved, limits)
            self._efforts.append((hand.name, solved.frame, effort))
            self.rows += rows_of(self._bodies, hand, solved, effort)
            reason = reason or effort.stop()
        return None if reason is None else f"stopped at frame {solved.frame:g}: {reason}"

    def notes(self) -> list[str]:
        """Frames at which bones' forces are estimates."""
        out = []
        for hand in self._bodies.hands:
            unsure = [
                frame for name, frame, effort in self._efforts if name == hand.name and np.isnan(effort.digits[0].flesh)
            ]
            if unsure:
                out.append(
                    f"{hand.name}: flesh alone finds no equilibrium in the pose of frame "
                    f"{', '.join(f'{frame:g}' for frame in unsure)}: what bones bear is estimated from contact"
                )
        return out

    def suggestions(self) -> list[str]:
        """What to open, at the frame that strains an actor most."""
        from warpjld.fem.hand.suggestions import suggestions

        out = []
        for hand in self._bodies.hands:
            mine = [(frame, effort) for name, frame, effort in self._efforts if name == hand.name]
            if not mine:
                continue
            worst = max(range(len(mine)), key=lambda k: mine[k][1].share)
            frame, effort = mine[worst]
            before = mine[worst - 1] if worst else None
            actor = self._scene.actor(hand.name)
            if actor.recorded is not None:
                continue
            moments = np.array([frame, frame if before is None else before[0]])
            angles, _ = actor.motion.sample(moments, actor.skeleton)
            found = suggestions(
                actor.skeleton, effort, angles[0], before and before[1], None if before is None else angles[1]
            )
            out += [f"{hand.name} at frame {frame:g}: {one.text}" for one in found]
        return out
