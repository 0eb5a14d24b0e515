"""Errors and costs of predictions, estimated before and after they are computed."""
