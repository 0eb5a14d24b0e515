"""Files: read as what strangers wrote, written whole, and the formats of plain values."""
