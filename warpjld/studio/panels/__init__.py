"""The studio's panels: what the state is shown and changed with. Each refreshes itself from the state."""
