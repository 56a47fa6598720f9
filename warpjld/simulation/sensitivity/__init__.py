"""How contact forces, digits' forces and pressures follow joint angles, places, moduli and friction."""
