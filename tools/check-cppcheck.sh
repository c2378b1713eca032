#!/bin/sh
# Static analysis of lib/ and firmware/ for the chip's word sizes. Members may start unset: the objects of the
# firmware are all static, hence zero, and to say so again would cost flash.
set -eu
cd "$(dirname "$0")/.."
includes=$(find lib -mindepth 1 -maxdepth 1 -type d -printf '-I%p ')
mkdir -p build/cppcheck
# shellcheck disable=SC2086  # the list of folders is words on purpose
cppcheck --quiet --error-exitcode=1 --std=c++11 --language=c++ --platform=avr8 --enable=warning,performance,portability \
    --inline-suppr --suppress=missingIncludeSystem --suppress=uninitMemberVar --cppcheck-build-dir=build/cppcheck $includes lib firmware
