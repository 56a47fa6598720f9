"""Contact laws: pressure, Coulomb friction, bonds."""
