"""Sparse stiffness matrices of 3×3 blocks: sparsity patterns, products and masks."""
