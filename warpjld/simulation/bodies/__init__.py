"""What may touch: deformable bodies with what drives them, obstacles, and all of them as one contact model."""
