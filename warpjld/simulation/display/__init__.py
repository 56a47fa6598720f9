"""Display: visible surfaces embedded in the bodies, separated where they overlap, with pressure maps."""
