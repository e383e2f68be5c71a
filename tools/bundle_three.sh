#!/bin/sh
# Makes pipeline/envgen_usd/exchange/viewer/page/three.js from the npm registry (three.js, MIT).
set -e
root=$(cd "$(dirname "$0")/.." && pwd)
page="$root/pipeline/envgen_usd/exchange/viewer/page"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$root/tools/three_entry.js" "$work"
cd "$work"
npm install --silent --no-audit --no-fund three@0.187.0 esbuild@0.28.2
npx esbuild three_entry.js --bundle --minify --format=esm --legal-comments=inline \
    --outfile="$page/three.js"
cp node_modules/three/LICENSE "$page/three.LICENSE"
