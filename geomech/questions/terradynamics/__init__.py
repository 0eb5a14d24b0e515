"""Questions about intruders and walking robots."""
