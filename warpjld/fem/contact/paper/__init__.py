"""The paper's loop of repelling and releasing (B Fig. 9)."""
