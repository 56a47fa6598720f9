"""Sparse stiffness matrices of 3×3 blocks: their pattern, products and masks."""
