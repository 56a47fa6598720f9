"""What is told: the table, efforts of muscles, the verdict, tactile readings, volumes."""
