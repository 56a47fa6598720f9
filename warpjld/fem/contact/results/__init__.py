"""Results of a contact solve: instants, contact of each pair, nodal values."""
