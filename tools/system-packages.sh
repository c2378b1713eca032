#!/bin/sh
# Installs the Debian packages behind what is missing, or names them in one line where that is not allowed.
#
#   tools/system-packages.sh build|avr|lint|fuzz|browser ...
#
# Each need is checked by what the project uses of it, so other distributions pass with their own packages.
set -eu

missing=
need() { # need DEBIAN-PACKAGE TEST...
    package=$1
    shift
    "$@" >/dev/null 2>&1 || missing="$missing $package"
}

python=${PYTHON:-python3}
python_headers() { test -f "$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h"; }
libfuzzer() {
    echo '#include <stddef.h>
        #include <stdint.h>
        extern "C" int LLVMFuzzerTestOneInput(const uint8_t*, size_t) { return 0; }' |
        clang++ -x c++ -fsanitize=fuzzer,address,undefined -o /dev/null -
}

browser() { command -v "${BIFA_CHROMIUM:-chromium}" || command -v chromium-browser || command -v google-chrome; }

for group in "$@"; do
    case $group in
    build) # Python environment, compiler and libraries of the virtual Uno
        need python3-venv "$python" -c 'import ensurepip, venv'
        need python3-dev python_headers
        need gcc command -v gcc
        need g++ command -v g++
        need libc6-dev test -f /usr/include/stdlib.h
        need libsimavr-dev test -f /usr/include/simavr/sim_avr.h
        need libelf-dev test -f /usr/include/libelf.h
        ;;
    avr) # what stands in for PlatformIO's packages
        need gcc-avr command -v avr-gcc
        need binutils-avr command -v avr-objcopy
        need avr-libc test -f /usr/lib/avr/include/avr/io.h
        need avrdude command -v avrdude
        need arduino-core-avr test -d /usr/share/arduino/hardware/arduino/avr/cores
        need simavr command -v simavr
        ;;
    lint)
        need clang-format command -v clang-format
        need cppcheck command -v cppcheck
        ;;
    fuzz) # Debian's names carry the version of clang
        major=$(clang++ -dumpversion 2>/dev/null | cut -d. -f1)
        major=${major:-$(apt-cache depends clang 2>/dev/null | sed -n 's/.*Depends: clang-\([0-9]*\)$/\1/p')}
        need clang command -v clang++
        need "libclang-rt-$major-dev" libfuzzer
        ;;
    browser) # tests of the pages
        need chromium browser
        ;;
    *)
        echo "error: $0 knows no group '$group' (build, avr, lint, fuzz, browser)" >&2
        exit 2
        ;;
    esac
done
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null; then
    echo "error: missing; Debian's names of the packages are:$missing" >&2
    exit 1
elif [ "$(id -u)" = 0 ]; then
    as_root=
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    as_root=sudo
else
    echo "error: these packages are missing, and only root may install them: sudo apt-get install$missing" >&2
    exit 1
fi

echo "Installing Debian packages:$missing"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() { $as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 -qq "$@" >"$log" 2>&1; }
# shellcheck disable=SC2086  # the list is words on purpose
apt install --yes --no-install-recommends $missing ||
    { apt update && apt install --yes --no-install-recommends $missing; } || {
    tail -n 5 "$log" >&2
    echo "error: apt-get could not install:$missing" >&2
    exit 1
}
