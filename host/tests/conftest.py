"""What holds for every test: properties are checked on the same examples every time, and never against the clock."""

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
