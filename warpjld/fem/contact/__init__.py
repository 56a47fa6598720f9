"""Contact of deformable bodies with one another and with obstacles (B §3.3, R93–R95, R108–R127)."""
