"""Maps over shape space: connections, CCFs and metrics."""
