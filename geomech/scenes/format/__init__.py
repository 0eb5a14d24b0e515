"""The form of scene files: keys, sections, columns, and what a reader checks."""
