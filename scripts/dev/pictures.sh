#!/usr/bin/env bash
# pictures.sh: makes the pictures of README.md again, in a minute after the build: the walker that the quickstart
# evolves, and the report of its run as Chromium shows it.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

need_packages "${build_packages[@]}" chromium
configure
build all
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# the report shows the run's path
cd "$folder"
"$build/limax" run "$root/scripts/experiments/walk.lua" --quiet --out walker
"$build/limax" picture walker --view iso --width 1000 --out "$root/scripts/walker.png"
"$build/limax" report walker --out report.html
chromium --headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader \
    --disable-background-networking --disable-component-update --disable-sync --no-first-run --hide-scrollbars \
    --user-data-dir="$folder/profile" --window-size=1100,1060 --force-device-scale-factor=0.65 \
    --virtual-time-budget=8000 --screenshot="$root/scripts/report.png" "file://$folder/report.html" 2>/dev/null
