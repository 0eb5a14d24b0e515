"""What all of geomech rests on, and nothing of its subject."""
