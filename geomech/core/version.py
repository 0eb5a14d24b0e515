"""The version of geomech."""

VERSION = "0.1.0"
