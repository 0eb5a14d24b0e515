"""Connections, CCFs and metrics of any velocity(alpha, alphadot), over shape space and along gaits."""
