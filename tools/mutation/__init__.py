"""Does a test miss each line of the safety code? Changes the code of the folders below, one place at a time, and runs
the Unity suites on each changed copy: a change that no suite notices is a survivor.
"""
