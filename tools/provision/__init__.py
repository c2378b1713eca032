"""Give PlatformIO what it needs to build this project, with its registry or without it.

Where the registry answers, PlatformIO downloads its own packages. Where it does not, a PlatformIO core
directory of stand-ins is laid out in `.platformio/`, made of PyPI's SCons and the distribution's AVR tools.
`platformio.ini` is the same in both worlds.
"""
