"""Build, measure and upload an image for an AVR with the tools of Debian's gcc-avr and avrdude."""

import sys

from SCons.Script import COMMAND_LINE_TARGETS, AlwaysBuild, Builder, Default, DefaultEnvironment

env = DefaultEnvironment()
machine = "-mmcu=$BOARD_MCU"
optimisation = ["-Os", "-flto"]

env.Replace(
    AR="avr-gcc-ar",
    AS="avr-as",
    CC="avr-gcc",
    CXX="avr-g++",
    GDB="avr-gdb",
    OBJCOPY="avr-objcopy",
    RANLIB="avr-gcc-ranlib",
    SIZETOOL="avr-size",
    ARFLAGS=["rc"],
    # Sections of `avr-size -A`: what occupies flash, what occupies RAM.
    SIZEPROGREGEXP=r"^(?:\.text|\.data|\.bootloader)\s+(\d+).*",
    SIZEDATAREGEXP=r"^(?:\.data|\.bss|\.noinit)\s+(\d+).*",
    SIZECHECKCMD="$SIZETOOL -A -d $SOURCES",
    SIZEPRINTCMD="$SIZETOOL --mcu=$BOARD_MCU -C -d $SOURCES",
    PROGSUFFIX=".elf",
)
if env.get("PROGNAME", "program") == "program":
    env.Replace(PROGNAME="firmware")

env.Append(
    ASPPFLAGS=["-x", "assembler-with-cpp", "$CCFLAGS"],
    CCFLAGS=[machine, *optimisation, "-g", "-Wall", "-ffunction-sections", "-fdata-sections"],
    CFLAGS=["-std=gnu11", "-fno-fat-lto-objects"],
    CXXFLAGS=[
        "-std=gnu++11",
        "-fno-exceptions",
        "-fno-threadsafe-statics",
        "-fpermissive",
        "-Wno-error=narrowing",
    ],
    LINKFLAGS=[machine, *optimisation, "-g", "-Wl,--gc-sections", "-fuse-linker-plugin"],
    LIBS=["m"],
    BUILDERS={
        "ElfToHex": Builder(
            action=env.VerboseAction("$OBJCOPY -O ihex -R .eeprom $SOURCES $TARGET", "Building $TARGET"),
            suffix=".hex",
        )
    },
)


def prepare_upload(target, source, env):
    """Find the port and tell avrdude, which resets the board into its bootloader through DTR."""
    upload = env.BoardConfig().get("upload", {})
    if env.subst("$UPLOAD_SPEED"):
        env.Append(UPLOADERFLAGS=["-b", "$UPLOAD_SPEED"])
    if upload.get("require_upload_port", False):
        env.AutodetectUploadPort()
        env.Append(UPLOADERFLAGS=["-P", "$UPLOAD_PORT"])


if "nobuild" in COMMAND_LINE_TARGETS:
    elf, image = "$BUILD_DIR/${PROGNAME}.elf", "$BUILD_DIR/${PROGNAME}.hex"
else:
    elf = env.BuildProgram()
    image = env.ElfToHex("$BUILD_DIR/${PROGNAME}", elf)
    env.Depends(image, "checkprogsize")

AlwaysBuild(env.Alias("nobuild", image))
env.AddPlatformTarget("size", elf, env.VerboseAction("$SIZEPRINTCMD", "Calculating size $SOURCE"))

upload_protocol = env.subst("$UPLOAD_PROTOCOL")
if upload_protocol == "custom":
    upload_actions = [env.VerboseAction("$UPLOADCMD", "Uploading $SOURCE")]
else:
    env.Replace(
        UPLOADER="avrdude",
        UPLOADERFLAGS=["-p", "$BOARD_MCU", "-c", "$UPLOAD_PROTOCOL", "-D"],
        UPLOADCMD='$UPLOADER $UPLOADERFLAGS -U flash:w:"$SOURCE":i',
    )
    upload_actions = [
        env.VerboseAction(prepare_upload, "Looking for upload port..."),
        env.VerboseAction("$UPLOADCMD", "Uploading $SOURCE"),
    ]
if not upload_protocol:
    sys.stderr.write("Error: the board names no upload protocol\n")
    env.Exit(1)
env.AddPlatformTarget("upload", image, upload_actions)

Default([image, "size"] if "nobuild" not in COMMAND_LINE_TARGETS else [image])
