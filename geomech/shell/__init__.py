"""The command line, and how values appear in terminals and notebooks."""
