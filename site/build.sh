#!/usr/bin/env bash
# Makes the web site: site/build.sh [FOLDER], by default target/site. The specification, what decoders do, the player with
# built-in scenes, and charts. Pages load nothing from elsewhere and their links are relative, so that the folder can be served at
# any path. Says what it leaves out where a tool is not there.
set -euo pipefail
site=${1:+$(realpath -m "$1")}
cd "$(dirname "$0")"
. ../bindings/web/tools.sh
site=${site:-$CARGO_TARGET_DIR/site}
if ! command -v python3 >/dev/null; then
    echo "skipped: the site, for which python3 is not there"
    exit 3
fi
rm -rf "$site"
mkdir -p "$site/scenes"
command_line

# A built-in scene of so many frames as a page that plays it, and a picture of it.
scene() {
    local made=$CARGO_TARGET_DIR/scenes/$1
    rm -rf "$made" && mkdir -p "$(dirname "$made")"
    "$SPLATSTREAM" demo --out "$made" --frames "$2" >/dev/null
    "$SPLATSTREAM" view "$made/demo.gss" -o "$site/scenes/$1.html" --title "$3" >/dev/null
    cp "$made/demo.gss" "$site/scenes/$1.gss"
    cp "$(ls "$made"/pictures/*.png | tail -n 1)" "$site/scenes/$1.png"
}

scene moving 24 'A moving scene'
scene still 1 'A scene that stands still'
# The page says with which command it was made.
(cd "$site" && "$SPLATSTREAM" chart --builtin --quick -o charts >/dev/null)
cp ../bindings/web/player.webp "$site/player.webp"

PATH="$CARGO_TARGET_DIR/tools/bin:$PATH"
if command -v mdbook >/dev/null; then
    mdbook build ../spec --dest-dir "$site/spec" 2>/dev/null
    # It knows one path that it is served at, and no other.
    rm -f "$site/spec/404.html"
    cp ../target/spec/*.pdf "$site/spec" 2>/dev/null || echo "skipped: the specification as PDF, which spec/pdf.sh makes"
else
    echo "skipped: the specification, for which mdBook is not there"
fi
python3 pages.py "$site"
echo "$site: $(find "$site" -type f | wc -l) files, $(du -sh "$site" | cut -f1)"
