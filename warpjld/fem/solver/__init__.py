"""Linear solvers, and static equilibrium by Newton's method."""
