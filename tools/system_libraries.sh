#!/bin/sh
# Installs what Debian and Ubuntu have as packages and Python cannot install, where it is missing
# and the user may: Python's venv and the OpenGL libraries for rendering without a screen.
set -eu
command -v dpkg-query >/dev/null 2>&1 || exit 0
python=${PYTHON:-python3}
missing=""
installed() { dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null | grep -q '^installed'; }
"$python" -c 'import ensurepip' 2>/dev/null || missing="$missing python3-venv"
for package in libegl1 libgl1-mesa-dri libosmesa6; do
    installed "$package" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0
if [ "$(id -u)" != 0 ]; then
    echo "These system packages are missing; install them and run the command again:" >&2
    echo "    sudo apt-get install$missing" >&2
    exit 0
fi
echo "installing$missing"
apt-get update -qq || true
for package in $missing; do
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$package" >/dev/null ||
        echo "could not install $package; go on without it" >&2
done
