"""Recognition of hands and bodies in joint trees of any origin (R12–R14)."""
