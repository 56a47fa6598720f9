"""What a contact solve gives back."""
