#!/usr/bin/env bash
# Makes the moving picture of the README again, player.webp: the player in Chromium with a moving scene.
set -euo pipefail
cd "$(dirname "$0")"
. ./tools.sh
browser || exit 3
command_line
scene=$(mktemp -d)
trap 'rm -rf "$scene"' EXIT
"$SPLATSTREAM" demo --out "$scene/demo" --frames 72 >/dev/null
node tests/picture.mjs "$scene/demo/demo.gss" player.webp
wc -c player.webp
