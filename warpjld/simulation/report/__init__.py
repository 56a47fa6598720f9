"""Evaluation of solved frames: contact table, muscle efforts, verdict, tactile readings, VTK volumes."""
