"""The paper's staggered contact loop: repel, then release (B Fig. 9, R113)."""
