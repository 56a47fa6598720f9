"""What is seen: visible surfaces carried by bodies, parted where they overlap, with pressure on them."""
