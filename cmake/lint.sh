#!/usr/bin/env bash
# Looks at the sources without running them; each command ends with 1 when it finds something.
#
#   cmake/lint.sh format        clang-format on every tracked C++ file
#   cmake/lint.sh tidy          clang-tidy on every translation unit
#   cmake/lint.sh tidy REVISION clang-tidy on what has changed since REVISION
#
# Both tools are pinned to one version: another one formats and warns differently.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly pinned=14

# find_pinned TOOL: the program of the pinned version, under whichever name it is installed.
find_pinned() {
    local name
    for name in "$1-$pinned" "$1"; do
        if command -v "$name" >/dev/null && "$name" --version | grep -q "version $pinned\."; then
            echo "$name"
            return
        fi
    done
    echo "lint: $1 $pinned is needed; found: $("$1" --version 2>/dev/null | head -n 1 || true)" >&2
    return 1
}

check_format() {
    local tool
    tool=$(find_pinned clang-format)
    git ls-files -z '*.hpp' '*.cpp' | xargs -0 --no-run-if-empty "$tool" --dry-run -Werror
    echo "lint: $(git ls-files '*.hpp' '*.cpp' | wc -l) files are formatted"
}

# The translation unit through which clang-tidy sees a file: itself, the source or the test that
# mirrors a header, or else the first source that includes it. Nothing for other files.
unit_of() {
    local file=$1 room_path
    case "$file" in
        *.cpp) echo "$file" ;;
        include/farfield/*.hpp)
            room_path=${file#include/farfield/}
            if [[ -e src/${room_path%.hpp}.cpp ]]; then
                echo "src/${room_path%.hpp}.cpp"
            else
                git grep -l --fixed-strings "#include <farfield/$room_path>" -- '*.cpp' |
                    head -n 1 || true
            fi
            ;;
        *.hpp) git grep -l --fixed-strings "$(basename "$file")\"" -- '*.cpp' | head -n 1 || true ;;
    esac
}

changed_units() {
    local file
    git diff --name-only --diff-filter=d "$1" -- '*.hpp' '*.cpp' |
        while read -r file; do unit_of "$file"; done | sort -u
}

check_tidy() {
    local tool units known
    tool=$(find_pinned clang-tidy)
    cmake --preset tidy >/dev/null
    # A unit that this configuration does not compile (a consumer project) has no compile command.
    known=$(sed -n "s|^ *\"file\": \"$PWD/\(.*\)\",\?$|\1|p" build/tidy/compile_commands.json | sort)
    if [[ $# -gt 0 ]]; then
        units=$(comm -12 <(changed_units "$1") <(echo "$known"))
    else
        units=$(comm -12 <(git ls-files '*.cpp' | sort) <(echo "$known"))
    fi
    local count
    count=$(grep -c . <<<"$units" || true)
    echo "lint: clang-tidy on $count translation units"
    [[ $count -gt 0 ]] || return 0
    # On stderr it counts the warnings that it has suppressed; whatever else is there is kept.
    xargs --max-procs="$(nproc)" --max-args=1 "$tool" -p build/tidy --quiet <<<"$units" \
        2> >(grep -v ' warnings\? generated\.$' >&2)
}

case "${1:-}" in
    format) check_format ;;
    tidy) check_tidy "${@:2}" ;;
    *)
        echo "usage: cmake/lint.sh format | tidy [REVISION]" >&2
        exit 2
        ;;
esac
