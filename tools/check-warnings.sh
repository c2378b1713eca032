#!/bin/sh
# Every file of lib/ compiles as C++11 without a warning, each header also on its own.
set -eu
cd "$(dirname "$0")/.."
includes=$(find lib -mindepth 1 -maxdepth 1 -type d -printf '-I%p ')
status=0
for file in $(find lib -name '*.cpp' -o -name '*.h' | sort); do
    # shellcheck disable=SC2086  # the list of folders is words on purpose
    g++ -std=gnu++11 -fsyntax-only -Wall -Wextra -Wpedantic -Wshadow -Werror $includes -x c++ -include "$file" - </dev/null || status=1
done
exit $status
