"""Formulas for numbers, arrays and the vectors of compiled code alike."""
