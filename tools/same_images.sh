#!/usr/bin/env bash
# Renders every technique of `edgeshade list` on every shipped scene with two binaries, and compares the pictures byte for
# byte: for changes that must not change any image.
#
#   tools/same_images.sh OLD_BINARY NEW_BINARY [TECHNIQUE]...
#
# Prints what differs. Exit status 0: all the same; 1: some picture differs, or only one of the binaries makes it; 2: usage.
# `edsm-x` may differ by a pixel from run to run, where two edges tie: the script reports it as it does any other.
set -euo pipefail

if (($# < 2)); then
    sed -n '2,8s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
old=$1 new=$2
shift 2
for binary in "$old" "$new"; do
    if [[ ! -x $binary ]]; then
        echo "$binary: no executable file" >&2
        exit 2
    fi
done

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# First words of the rows of a table, up to the first empty line. A rule ends the heading; continuation lines are indented.
first_words() { awk '/^─/ { n = 0; next } NF == 0 { exit } /^[^ ]/ { word[n++] = $1 } END { for (i = 0; i < n; i++) print word[i] }'; }
techniques() { "$1" list | first_words; }
scenes() { "$1" scenes | first_words; }
for list in techniques scenes; do
    if [[ $($list "$old") != "$($list "$new")" ]]; then
        echo "the two binaries list different $list" >&2
        exit 1
    fi
done

failed=0 same=0
compare() { # <name of the picture> <argument>...
    local picture=$1 status=() file
    shift
    for which in old new; do
        file=$folder/$which-$picture
        # The cache is off, because the two binaries would share it.
        if "${!which}" render "$@" --size 320x180 --shadow-map 256 --frames 1 --cache off -o "$file" \
            >"$folder/log" 2>&1; then
            status+=(0)
        else
            status+=("$?")
            echo "$which binary, $picture: $(tail -n 1 "$folder/log")"
        fi
    done
    if [[ ${status[*]} == "0 0" ]] && cmp -s "$folder/old-$picture" "$folder/new-$picture"; then
        same=$((same + 1))
    else
        [[ ${status[*]} == "0 0" ]] && echo "differs: $picture ($*): $(bytes_differing "$picture") bytes"
        failed=$((failed + 1))
    fi
    rm -f "$folder"/*-"$picture"
}
bytes_differing() { cmp -l "$folder/old-$1" "$folder/new-$1" 2>/dev/null | wc -l; }

if (($#)); then wanted=("$@"); else mapfile -t wanted < <(techniques "$old"); fi
mapfile -t all_scenes < <(scenes "$old")
for scene in "${all_scenes[@]}"; do
    compare "$scene.png" "$scene"
    for technique in "${wanted[@]}"; do
        # The file holds floats, so rounding to 8-bit codes cannot hide a difference.
        compare "$scene-$technique.exr" "$scene" -t "$technique" --view visibility
    done
    echo "$scene: $same pictures the same so far, $failed not, after $SECONDS s"
done
((failed == 0))
