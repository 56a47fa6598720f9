"""Contact interfaces: pairs, surfaces, contact points (node-to-surface and mortar), areas of contact."""
