"""The Arduino framework: Debian's AVR core and the board's pin variant, as one library to link against."""

from pathlib import Path

from SCons.Script import DefaultEnvironment

env = DefaultEnvironment()
board = env.BoardConfig()
framework = Path(env.PioPlatform().get_package_dir("framework-arduino-avr"))
core = framework / "cores" / board.get("build.core")
variant = framework / "variants" / board.get("build.variant")


def without_warnings(env, node):
    """Compile one of Arduino's own files without gcc 5.4's warnings, which are not this project's concern."""
    return env.Object(node, CCFLAGS=[*env["CCFLAGS"], "-w"])


env.AddBuildMiddleware(without_warnings, f"*{framework.name}/*")
env.Append(
    CPPDEFINES=[
        ("F_CPU", "$BOARD_F_CPU"),
        ("ARDUINO", 10808),
        "ARDUINO_ARCH_AVR",
        # Debian's core names DECIMAL_DIG, which gcc 5.4 predefines under its reserved name only.
        ("DECIMAL_DIG", "__DECIMAL_DIG__"),
    ],
    CPPPATH=[str(core), str(variant)],
    LIBSOURCE_DIRS=[str(framework / "libraries")],
    LIBS=[env.BuildLibrary("$BUILD_DIR/FrameworkArduino", str(core))],
)
