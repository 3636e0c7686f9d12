#!/bin/sh
# Makes the pictures of README and docs from runs on this machine: docs/pictures.sh BIN. Needs chromium.
set -eu
bin=$1
here=$(dirname "$0")/pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$here"
"$bin/firmware-runtime" diagram tachobot -o "$here/tachobot.svg"
"$bin/firmware-runtime" run detective --doubles --clock virtual --plot "$here/arena.svg" >"$work/detective.txt"
"$bin/firmware-runtime" run tachobot --doubles --for 10 --statistics "$work/tachobot.stats" >"$work/tachobot.txt"
"$bin/firmware-runtime" report "$work/tachobot.stats" -o "$work/report.html"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1100,740 \
	--screenshot="$here/report.png" "file://$work/report.html" 2>"$work/chromium.txt"
echo "pictures: $here/tachobot.svg arena.svg report.png"
