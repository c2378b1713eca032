"""Build a program for this computer with the compiler found on PATH."""

from SCons.Script import AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()
env.Replace(AR="ar", CC="gcc", CXX="g++", RANLIB="ranlib", SIZETOOL=None, PROGNAME="program", PROGSUFFIX="")

program = env.BuildProgram()
env.AddPlatformTarget("exec", program, [env.VerboseAction('"$PROGPATH" $PROGRAM_ARGS', "Running $PROGPATH")])
AlwaysBuild(program)
Default(program)
