"""Detection of misplaced joints (R14), which cause bad deformation."""
