"""Give PlatformIO what it needs to build this project, with its registry or without it.

If the registry answers, PlatformIO downloads its own packages. If not, a PlatformIO core directory of stand-ins is laid
out in `.platformio/`, made from PyPI's SCons and the distribution's AVR tools. `platformio.ini` is the same either way.
"""
