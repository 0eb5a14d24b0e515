"""Results: how any result is shown, written and read back.

`geomech.core.variables` is the value, `show.py` its text, `html.py` its form in a
notebook, `files.py` its files, `old.py` the names in files of before. None of them
knows a question: what a kind of result adds (headline, summary, remarks, picture,
files) is found by `kinds.py`.
"""
