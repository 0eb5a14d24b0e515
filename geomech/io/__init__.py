"""Files: read within limits, written atomically, and the formats of plain values."""
