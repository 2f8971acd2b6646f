#!/bin/sh
# Install the readers that tests/browser holds our files against: a browser, and npm packages into .browser/.
# Needs npm; the browser is Debian's, and is left alone where there is one.  Silent when there is nothing to do.
cd "$(dirname "$0")/.." || exit 1
set -e

if ! command -v chromium >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null
fi
if ! cmp -s tests/browser/package.json .browser/package.json || [ ! -d .browser/node_modules ]; then
    mkdir -p .browser
    cp tests/browser/package.json .browser/package.json.new
    mv .browser/package.json.new .browser/package.json
    npm install --prefix .browser --no-audit --no-fund --ignore-scripts --loglevel=error >/dev/null ||
        { rm -rf .browser && exit 1; }
fi
