"""Contact interfaces: pairs, surfaces, contact points (node-to-surface and mortar), contact areas."""
