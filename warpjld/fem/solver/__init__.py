"""Sparse block matrices, linear solvers, Newton's method."""
