"""Sensitivities of contact forces, digit loads and pressures to joint angles, placements, moduli and friction."""
