"""Contact laws: pressure, Coulomb friction and bonds of one interface; its state and multiplier update."""
