"""Checks, refusals, registries and threads, which know no mechanics."""
