"""Hostile input, drawn from seeds: what goes in may be anything, what comes out is a result or an error of our own.

`families.FAMILIES` is the table of all families. The normal suite runs a fixed number of cases of each
(`test_fuzz.py`); ``make fuzz MINUTES=60 SEED=7`` goes on with new ones until the time is over (`__main__.py`).
"""
